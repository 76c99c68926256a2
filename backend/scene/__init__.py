"""The axes in 3D: turning and sliding parts at their live positions, with software limits."""
