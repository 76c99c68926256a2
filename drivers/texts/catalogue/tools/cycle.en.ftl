cycle_evaluating = evaluating
cycle_reading = reading torque and speed for { NUM($limit_s, format: "g") } s; nothing is written
cycle_recording-lacks-signal = { QUOTED($value) } has no { $parameter } of { $drive }
    .remedy = record actual torque and actual speed of this drive
cycle_title = Load of the machine's cycle
cycle_too-few-samples = { $value } samples of torque and speed are too few: at least { $limit } are needed
    .remedy = check the connection, or read for longer
