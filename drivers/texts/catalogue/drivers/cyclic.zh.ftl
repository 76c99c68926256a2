cyclic_axis-being-disabled = 正在断使能
cyclic_braking = { $where } 正在制动：{ $why }
    .remedy = 请等待其静止
cyclic_cycle-cannot-reported-drive = 无法向驱动器设置 { NUM($cycle_us, format: "g") } µs 的周期
    .remedy = 请选择其他周期，如 1 ms
cyclic_limit-cannot-watched-not = { $where }：无法监视{ $name ->
    [travel] 行程
    [speed] 速度
    [torque] 转矩
   *[following-error] 跟随误差
 }限值，未映射 { NUM($index, format: "04X") }h
    .remedy = 请将 { NUM($index, format: "04X") }h 配置到周期数据中
cyclic_mode-setpoint-needs-mode = { $where } 处于模式 { $mode }，此设定值需要模式 { $wanted }（{ $mode_names }）
    .remedy = 请在使能轴时选择模式
cyclic_motion-ended = 运动已结束
cyclic_motion-needs-enabled-again = { $where } 处于 { QUOTED($state) }，运动需要“运行使能（Operation enabled）”：{ $cause }
    .remedy = 请消除原因，然后重新使能该轴
cyclic_motion-needs-operation-enabled = { $where } 处于 { QUOTED($state) }，运动需要“运行使能（Operation enabled）”
    .remedy = 请先使能该轴
cyclic_not-come-rest-ramp = 斜坡结束时未静止：轴已停止并断使能
cyclic_not-cyclic-data = { $where }：{ NUM($index, format: "04X") }h 不在周期数据中
    .remedy = 请将此目标值配置到周期数据中
cyclic_not-setpoint-cyclic-motion = { $target } 不是周期模式的设定值
    .remedy = 请使用位置、速度或转矩
cyclic_offsets-values-trajectory-differ = 轨迹的偏移与数值个数不同
cyclic_setpoints-go-envelope-allows = { $kind } 设定值为 { $min_values } 至 { $max_values }，限值允许 { $low } 至 { $high }
    .remedy = 请缩短运动或放宽限值
cyclic_station-braking = 站 { $station } 正在制动：{ $why }
    .remedy = 请等待其静止
cyclic_station-control-word-not = 站 { $station }：控制字不在周期数据中
cyclic_station-fault-cannot-enabled = 站 { $station } 有故障，不能使能
    .remedy = 请读取当前故障，排除原因并复位故障
cyclic_station-halted-meanwhile = 站 { $station } 在写入模式时被停止：不使能
    .remedy = 若仍需要请重新使能
cyclic_station-moves-mode-cannot = 站 { $station } 正在运动：此时不能更改模式
    .remedy = 请断使能并等待其静止
cyclic_trajectory-begins-axis-held = { $where }：轨迹起点为 { $value }，而轴保持在 { $now }
    .remedy = 请从轴所在位置开始
cyclic_trajectory-goes-holds = 轨迹为 { $min_values } 至 { $max_values }，{ $address } 可容纳 { $low } 至 { $high }
cyclic_trajectory-without-values = { $where }：轨迹没有数值
cyclic_trajectory-without-values-2 = 轨迹没有数值
