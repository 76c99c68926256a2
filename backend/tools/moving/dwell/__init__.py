"""Dwell: vibration at one frequency, for a person who searches for rattling parts."""
