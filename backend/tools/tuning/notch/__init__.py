"""Notches of a drive: reading, writing, and measuring the effect of their values."""
