"""Automatic tuning: from an unknown axis to a tuned and verified one."""
