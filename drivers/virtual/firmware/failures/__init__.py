"""Faults, warnings and their reactions, and failures that a test causes on purpose."""
