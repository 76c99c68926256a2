"""Models of mechanics, inertia and friction, and their fits."""
