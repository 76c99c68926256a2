"""Cycle load: what a machine's cycle asks of motor and drive, by reading alone."""
