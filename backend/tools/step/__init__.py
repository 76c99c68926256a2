"""Step and move responses with their figures."""
