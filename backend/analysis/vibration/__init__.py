"""Vibration at constant speed: sinusoids, orders, level peaks, and a dwell at one frequency."""
