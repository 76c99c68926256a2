"""First power: the checks before a loop is closed over a motor for the first time."""
