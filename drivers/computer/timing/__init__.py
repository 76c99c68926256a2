"""Punctuality: clocks, real-time scheduling, measured delays, settings that cost time."""
