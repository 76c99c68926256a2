first-power_enabled = { $drive } 已使能：首次通电须从电机未得电的状态开始
    .remedy = 请先断使能该轴
first-power_pulses = 小转矩脉冲
first-power_reading = 正在读取电源和分辨率
first-power_say-what-hangs = { $drive }：警告：抱闸松开时悬挂的负载会坠落，而尚未声明此轴上是否悬挂负载
    .remedy = 请支撑悬挂负载并声明（load_supported），或声明没有负载对该轴施力，如重力或弹簧力（nothing_hangs）
first-power_turn = 请用手将轴正向转动 { $revolutions } 圈至标记处，并操作限位开关
first-power_title = 首次通电
