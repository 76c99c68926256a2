"""Routes of parameter sets and parameter lists."""
