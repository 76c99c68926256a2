"""Command shaping: the slow vibration that a move leaves, and setpoints that do not excite it."""
