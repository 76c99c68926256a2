"""Gantry: the 2×2 response of two coupled axes, their skew at rest, and the margins of the pair."""
