"""Measurements of motor, load and brake: first power, inertia, friction, brake and load side."""
