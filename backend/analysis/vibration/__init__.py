"""Vibration at constant speeds: sinusoids, orders, level peaks, and a dwell at one frequency."""
