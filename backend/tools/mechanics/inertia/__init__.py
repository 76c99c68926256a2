"""Inertia and friction from moves made by the host."""
