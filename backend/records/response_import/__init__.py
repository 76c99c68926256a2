"""Frequency responses from recordings of other programs: reading, units, evaluation, storing."""
