"""Axes and their drives: identity, values, scales, motion authority, power, STOP, scope."""
