"""Parameter sets and parameter lists."""
