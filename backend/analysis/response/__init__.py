"""Frequency response of recordings that other programs made: excitation, estimate, modes, band."""
