"""Closed loops: structure, margins, gain and notch design."""
