"""Moves in profile modes, homing, the drive's own procedures and identification."""
