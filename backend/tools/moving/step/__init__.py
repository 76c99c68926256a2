"""Step and move responses and the figures read from them."""
