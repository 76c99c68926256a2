"""Condition and acceptance of an axis: health, trend, vibration, load of a cycle, safety."""
