"""Recordings of other programs as responses: reading the file, units, evaluation, stored form."""
