"""Frequency response of recordings from other programs: excitation, estimate, modes, band."""
