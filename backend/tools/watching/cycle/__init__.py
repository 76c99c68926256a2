"""Cycle load: the load of a machine's cycle on motor and drive, by reading alone."""
