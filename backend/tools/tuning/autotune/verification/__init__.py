"""Measurement of a tuned loop: its reference, steps of its gain, and the verdict."""
