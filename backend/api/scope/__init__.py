"""Scope set-ups, recordings, rerun and the 3D scene."""
