"""Mechanics of virtual drives: inertia chain, friction, travel and their exact response."""
