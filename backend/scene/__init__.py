"""The bench in 3D: what turns, what slides, and where its limits are, from live positions."""
