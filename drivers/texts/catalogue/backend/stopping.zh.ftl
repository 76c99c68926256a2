stopping_coasts = 停止（STOP）后 { $drive } 的功率级已关断，{ $speed ->
        [none] {""}
       *[other] 正以 { $speed } { $unit }{" "}
    }自由停车：静止之前请勿靠近
stopping_ended-unwatched = 在确认静止之前已从轴列表移除
stopping_mode-not-changed = 驱动器未切换模式
stopping_no-answer = 无应答
stopping_not-on-bench = 不在此轴列表中
stopping_not-reached = 停止命令（STOP）未到达 { $drive }：请使用机器的急停
stopping_not-reached-why = 停止命令（STOP）未到达 { $drive }（{ $why }）：请使用机器的急停
stopping_not-tell-how-moves = { $drive } 未上报其运动状态
    .remedy = 请使用机器的急停
stopping_option-not-changed = 驱动器保持原值
stopping_still-moves = 停止（STOP）后 { $drive } 仍{ $speed ->
        [none] {""}
       *[other] 以 { $speed } { $unit }{" "}
    }运动：请使用机器的急停
stopping_turns-with-power = { $drive } 已使能并以 { $speed } { $unit } 转动，但此处无人操作：请按“停止”（STOP）
stopping_turns-without-power = { $drive } 在未得电时以 { $speed } { $unit } 转动：由人手、重力或驱动器自身引起
stopping_superseded = STOP 后尚未确认 { $drive } 静止，就已收到新的命令
    .remedy = 请观察该轴；如不允许其运动，请再次按下 STOP
