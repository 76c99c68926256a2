"""Inertia, friction and further loads from bidirectional moves, and the moves for it."""
