"""First power: what must be known before a loop is closed over a motor for the first time."""
