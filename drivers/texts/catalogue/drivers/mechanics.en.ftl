mechanics_backlash-count = load: at most three couplings of a chain may have backlash
mechanics_cannot-hold = friction: gravity_nm { NUM($gravity_nm, format: "g") } is more than this motor holds even for a moment ({ NUM($peak, format: "g") } times rated_torque_nm: { NUM($most_nm, format: "g") } Nm); torques are those at the motor shaft, behind the gear
mechanics_cannot-hold-place = friction: gravity_nm { NUM($gravity_nm, format: "g") } with torque_nm { NUM($torque_nm, format: "g") } of place is more than this motor holds even for a moment ({ NUM($peak, format: "g") } times rated_torque_nm: { NUM($most_nm, format: "g") } Nm); torques are those at the motor shaft, behind the gear
mechanics_gantry-of-servos = a gantry needs virtual servo drives
mechanics_home-cam = switches: the home cam must begin before it ends: home_from_rev { NUM($begin, format: "g") }, home_to_rev { NUM($end, format: "g") }
mechanics_switch-beyond-stops = switches: { $name } { NUM($place, format: "g") } lies beyond the end stops ({ NUM($low, format: "g") } to { NUM($high, format: "g") }) and would never trip
mechanics_switch-order = switches: negative_limit_rev { NUM($low, format: "g") } must lie below positive_limit_rev { NUM($high, format: "g") }
mechanics_switch-room = switches: the negative limit switch at { NUM($low, format: "g") } and the positive one at { NUM($high, format: "g") } revolutions leave no room between them
mechanics_travel-order = travel: the start position 0 must lie between min_rev { NUM($low, format: "g") } and max_rev { NUM($high, format: "g") }, and there must be room between them
mechanics_no-virtual = no virtual { QUOTED($drive) }; there are: { $known }
mechanics_no-virtual-bits = no virtual { QUOTED($drive) }: its PDO { NUM($index, format: "04X") }h holds single bits, which a virtual drive does not map
mechanics_no-virtual-units = no virtual { QUOTED($drive) }: its { $quantity ->
    [position] positions
    [velocity] speeds
   *[acceleration] accelerations
 } are in { QUOTED($unit) }; a virtual drive has increments and rpm, with or without a power of ten
