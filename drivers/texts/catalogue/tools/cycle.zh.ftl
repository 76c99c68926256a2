cycle_evaluating = 正在计算
cycle_reading = 正在读取转矩和速度，共 { NUM($limit_s, format: "g") } s；不写入任何数据
cycle_recording-lacks-signal = { QUOTED($value) } 中没有 { $drive } 的 { $parameter }
    .remedy = 请录制该驱动器的实际转矩和实际速度
cycle_title = 机器循环负载
cycle_too-few-samples = 转矩和速度只有 { $value } 个采样，过少：至少需要 { $limit } 个
    .remedy = 请检查连接，或延长读取时间
