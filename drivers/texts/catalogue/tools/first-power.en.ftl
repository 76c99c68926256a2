first-power_enabled = { $drive } is enabled: the first power begins with a motor without power
    .remedy = disable the axis first
first-power_pulses = small pulses of torque
first-power_reading = reading supply and resolution
first-power_say-what-hangs = { $drive }: nobody has said whether a load hangs at this axis, and one would fall when its brake opens
    .remedy = support a hanging load and state that (load_supported), or state that none pulls at the axis (nothing_hangs)
first-power_turn = turn the shaft forwards by hand by { $revolutions } rev, to its mark, and operate the limit switches
first-power_title = First power
