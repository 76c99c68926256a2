"""Path from sent setpoint to recorded signal: sampling, hold, delay, current loop."""
