"""Command shaping: residual vibration of a move, and setpoints that do not excite it."""
