stopping_not-tell-how-moves = { $drive } does not tell how it moves
    .remedy = use the machine's emergency stop
