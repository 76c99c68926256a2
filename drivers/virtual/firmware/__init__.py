"""Firmware of virtual drives: dictionary, CiA 402, modes, protections and the 50 µs loop."""
