"""Friction map: torque over speed and over position, both directions."""
