"""From an unknown axis to a tuned and verified one."""
