"""Frequency response and what is set by it: sweep, notches, shaping, gantry and autotune."""
