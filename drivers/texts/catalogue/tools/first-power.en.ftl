first-power_enabled = { $drive } is enabled: first power starts with a motor without power
    .remedy = disable the axis first
first-power_pulses = small pulses of torque
first-power_reading = reading supply and resolution
first-power_say-what-hangs = { $drive }: WARNING: a hanging load falls when the brake opens, and it is not stated whether a load hangs at this axis
    .remedy = support the load and state that (load_supported), or state that no load pulls at the axis (nothing_hangs)
first-power_turn = turn the shaft forwards by hand by { $revolutions } rev, to its mark, and operate the limit switches
first-power_title = First power
