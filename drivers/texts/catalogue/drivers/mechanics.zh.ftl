mechanics_backlash-count = load：一条传动链中最多三个联轴器可有间隙
mechanics_cannot-hold = friction：gravity_nm { NUM($gravity_nm, format: "g") } 超出此电机短时所能保持的转矩（rated_torque_nm 的 { NUM($peak, format: "g") } 倍：{ NUM($most_nm, format: "g") } Nm）；转矩均指减速机之前的电机轴上的转矩
mechanics_cannot-hold-place = friction：gravity_nm { NUM($gravity_nm, format: "g") } 加上 place 的 torque_nm { NUM($torque_nm, format: "g") } 超出此电机短时所能保持的转矩（rated_torque_nm 的 { NUM($peak, format: "g") } 倍：{ NUM($most_nm, format: "g") } Nm）；转矩均指减速机之前的电机轴上的转矩
mechanics_gantry-of-servos = 龙门需要虚拟伺服驱动器
mechanics_home-cam = switches：原点凸轮的起点必须小于终点：home_from_rev { NUM($begin, format: "g") }，home_to_rev { NUM($end, format: "g") }
mechanics_switch-beyond-stops = switches：{ $name } { NUM($place, format: "g") } 位于机械限位（{ NUM($low, format: "g") } 至 { NUM($high, format: "g") }）之外，永远不会动作
mechanics_switch-order = switches：negative_limit_rev { NUM($low, format: "g") } 必须小于 positive_limit_rev { NUM($high, format: "g") }
mechanics_switch-room = switches：负限位开关位于 { NUM($low, format: "g") } 转，正限位开关位于 { NUM($high, format: "g") } 转，两者之间没有行程
mechanics_travel-order = travel：起始位置 0 必须在 min_rev { NUM($low, format: "g") } 与 max_rev { NUM($high, format: "g") } 之间，且两者之间须有行程
mechanics_no-virtual = 没有虚拟的 { QUOTED($drive) }；现有：{ $known }
mechanics_no-virtual-bits = 没有虚拟的 { QUOTED($drive) }：其 PDO { NUM($index, format: "04X") }h 含有单个位，虚拟驱动器不能映射
mechanics_no-virtual-units = 没有虚拟的 { QUOTED($drive) }：其{ $quantity ->
    [position] 位置
    [velocity] 速度
   *[acceleration] 加速度
 }的单位为 { QUOTED($unit) }；虚拟驱动器只有增量和 rpm（可带 10 的幂）
