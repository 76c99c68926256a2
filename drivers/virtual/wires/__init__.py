"""Slave ends of the buses."""
