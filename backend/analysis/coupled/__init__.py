"""Two mechanically coupled axes: their 2×2 response, its modes, and the stability of both loops."""
