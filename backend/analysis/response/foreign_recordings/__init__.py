"""Responses from recordings of other programs: excitation, estimate, modes and band."""
