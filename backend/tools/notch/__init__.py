"""Notches of a drive: read, write, and measure what their values do."""
