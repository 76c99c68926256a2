"""Two mechanically coupled axes: 2×2 response, its modes, and the stability of both loops."""
