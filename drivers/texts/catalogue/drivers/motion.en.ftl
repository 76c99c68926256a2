motion_account-has-another-role = the role of the person who began it was changed
    .remedy = ask an administrator for the right to move
motion_beyond-limit = { $quantity ->
    [position] position
    [speed] speed
    [torque] torque
    [skew] skew
   *[following-error] following error
 } { $value } is beyond the limit of { $limit }: the axis is braked and disabled
motion_beyond-limit-in = { $quantity ->
    [position] position
    [speed] speed
    [torque] torque
    [skew] skew
   *[following-error] following error
 } { $value } { $unit } is beyond the limit of { $limit } { $unit }: the axis is braked and disabled
motion_by-door = { $how } ({ $route })
motion_commanded = it was halted
motion_contradiction = 606Ch reads { NUM($speed, format: ".6g") }, the position gives { NUM($from_position, format: ".6g") } (raw units of 606Ch; { $note }): the axis is braked and disabled
motion_door-assign = choose what a terminal does on the I/O page, with the axis disabled
motion_door-force = force terminals on the I/O page
motion_door-move = move the axis on the Motion page, which sets limits and a dead-man timeout
motion_door-power = enable the axis and choose its mode on the Motion page
motion_door-procedure = run the procedure “{ $title }”
motion_door-set = a person with the right to move sets it, with the axis disabled
motion_expired = the setpoints were not renewed in time: the axis is braked and disabled
motion_following = the following error is beyond its limit
motion_halted = { $where }: { $cause }
motion_left-enabled = the drive left Operation enabled: { $by ->
        [fault] it has a fault
        [quick_stop] a quick stop that was not commanded here (a terminal, another master or the drive itself)
        [voltage] main power is gone, or STO is open
        [others] another master, a terminal or the panel of the drive took its power away
       *[other] { "" }
    }{ $by ->
        [fault] { " (" }{ $note })
        [quick_stop] { " (" }{ $note })
        [voltage] { " (" }{ $note })
        [others] { " (" }{ $note })
       *[other] { $note }
    }
motion_lost = no more cyclic data are received
motion_measured-contradict = measured position and speed contradict each other
motion_move-axis-permission-hand = { $drive }: { $parameter } can move the axis, and the present permission does not cover it
    .remedy = begin the motion anew on the Motion page
motion_moved-already = { $drive } is moved already: { $purpose }
    .remedy = wait for it to end, or stop it
motion_nobody-asked-motion-not = { $drive }: this motion was not requested, so it is not begun
    .remedy = begin it on the Motion page
motion_partner = the other axis of this machine was stopped: { $note }
motion_permission-move-ended = { $drive }: { $purpose }: the permission to move has ended: { $why }
    .remedy = begin the motion anew when it is safe
motion_position = the position is beyond its limit
motion_put-energy-motor-not = { $drive }: { $parameter } { $key } can energise the motor, so it is not written as a parameter
motion_session-is-over = the session of the person who began it has ended
    .remedy = log in, then start it again
motion_skew = the skew of both axes is beyond its limit
motion_speed = the speed is beyond its limit
motion_stop-was-pressed = STOP was pressed
    .remedy = find out why STOP was pressed; start again when it is safe
motion_time-is-over = the motion reached its longest time
    .remedy = start it again; it may need fewer repeats or a shorter range
motion_torque = the torque is beyond its limit
motion_unfit = a setpoint does not fit its object: the axis is braked
motion_class-fixed = { $profile_title }: { $key } { $name }: { $why }
motion_class-from-manual = it comes with servodeck and has its classes from the manual
motion_class-in-profile = its class stands in the profile
motion_class-needs-reason = { $key }: a reason for this motion class is needed
motion_class-not-writable = it cannot be written, so it has no motion class
motion_class-of-no-parameter = { $profile_title } has no parameter { $key }
motion_class-of-standard = its class is that of the standard (CiA 301, CiA 402)
motion_purpose-brake-test = brake test
motion_purpose-command-line = measurement from the command line
motion_purpose-exchange = motion through the cyclic exchange
motion_purpose-first-power = first power
motion_purpose-left-enabled = left enabled
motion_purpose-profile-velocity = measurement in Profile velocity
motion_purpose-restore = restoring what a motion changed
motion_purpose-set = setting { $key } { $name }
motion_purpose-set-why = setting { $key } { $name }: { $reason }
motion_purpose-state = to “{ $state }”
