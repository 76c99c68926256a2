stopping_not-tell-how-moves = { $drive } 未上报其运动状态
    .remedy = 请使用机器的急停
