"""Gantry: 2×2 response of two coupled axes, their skew at standstill, and the pair's margins."""
