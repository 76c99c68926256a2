"""Checks of the speed and torque that a drive reports, before a response relies on them."""
