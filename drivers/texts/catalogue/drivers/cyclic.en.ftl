cyclic_axis-being-disabled = the axis is being disabled
cyclic_braking = { $where } is braking: { $why }
    .remedy = wait for standstill
cyclic_cycle-cannot-reported-drive = a cycle of { NUM($cycle_us, format: "g") } µs cannot be commanded to the drive
    .remedy = choose another cycle, such as 1 ms
cyclic_limit-cannot-watched-not = { $where }: the { $name ->
    [travel] travel
    [speed] speed
    [torque] torque
   *[following-error] following error
 } limit cannot be watched, { NUM($index, format: "04X") }h is not mapped
    .remedy = configure the cyclic data with { NUM($index, format: "04X") }h
cyclic_mode-setpoint-needs-mode = { $where } is in mode { $mode }, this setpoint needs mode { $wanted } ({ $mode_names })
    .remedy = choose the mode when enabling the axis
cyclic_motion-ended = the motion was ended
cyclic_motion-needs-enabled-again = { $where } is in { QUOTED($state) }, a motion needs 'Operation enabled': { $cause }
    .remedy = remove the cause, then enable the axis again
cyclic_motion-needs-operation-enabled = { $where } is in { QUOTED($state) }, a motion needs 'Operation enabled'
    .remedy = enable the axis first
cyclic_not-come-rest-ramp = no standstill at the end of the ramp: the axis is stopped and disabled
cyclic_not-cyclic-data = { $where }: { NUM($index, format: "04X") }h is not in the cyclic data
    .remedy = configure the cyclic data with this target
cyclic_not-setpoint-cyclic-motion = { $target } is not a setpoint for cyclic motion
    .remedy = play a position, velocity or torque
cyclic_offsets-values-trajectory-differ = offsets and values of a trajectory differ in number
cyclic_setpoints-go-envelope-allows = the { $kind } setpoints go from { $min_values } to { $max_values }, the envelope allows { $low } to { $high }
    .remedy = shorten the move or widen the envelope
cyclic_station-braking = station { $station } is braking: { $why }
    .remedy = wait for standstill
cyclic_station-control-word-not = station { $station }: the control word is not in the cyclic data
cyclic_station-fault-cannot-enabled = station { $station } has a fault and cannot be enabled
    .remedy = read its active faults, remove the cause and reset the fault
cyclic_station-halted-meanwhile = station { $station } was halted while its mode was written: it is not enabled
    .remedy = enable it again if it is still wanted
cyclic_station-moves-mode-cannot = station { $station } moves: its mode cannot be changed now
    .remedy = disable the axis and wait for standstill
cyclic_trajectory-begins-axis-held = { $where }: the trajectory begins at { $value }, the axis is held at { $now }
    .remedy = start at the present position
cyclic_trajectory-goes-holds = the trajectory goes from { $min_values } to { $max_values }, { $address } holds { $low } to { $high }
cyclic_trajectory-without-values = { $where }: a trajectory without values
cyclic_trajectory-without-values-2 = a trajectory without values
