"""Dwell: the axis vibrates at one frequency, for a person who looks for what rattles."""
