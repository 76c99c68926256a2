"""Measurements, notches, gains, design and the automatic tuning."""
