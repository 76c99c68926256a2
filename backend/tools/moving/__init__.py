"""Moves of one axis that a person asks for: jog, moves in profile modes, step and dwell."""
