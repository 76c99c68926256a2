stopping_coasts = { $drive } has no power and coasts{ $speed ->
        [none] {""}
       *[other] {" "}at { $speed } { $unit }
    } after STOP: keep clear until standstill
stopping_ended-unwatched = it was removed from the axis list before standstill was confirmed
stopping_mode-not-changed = the drive does not change its mode
stopping_no-answer = no answer
stopping_not-on-bench = not on this bench
stopping_not-reached = STOP did not reach { $drive }: use the machine's emergency stop
stopping_not-reached-why = STOP did not reach { $drive } ({ $why }): use the machine's emergency stop
stopping_not-tell-how-moves = { $drive } does not report its motion
    .remedy = use the machine's emergency stop
stopping_option-not-changed = the drive keeps its value
stopping_still-moves = { $drive } still moves{ $speed ->
        [none] {""}
       *[other] {" "}at { $speed } { $unit }
    } after STOP: use the machine's emergency stop
stopping_turns-with-power = { $drive } is enabled and turns at { $speed } { $unit }, but nobody moves it with servodeck: press STOP
stopping_turns-without-power = { $drive } turns at { $speed } { $unit } without power: by hand, by gravity or by the drive itself
stopping_superseded = a new command was given to { $drive } before its standstill after STOP was seen
    .remedy = look at the axis; press STOP again if it must not move
