"""Which writable objects can cause motion: rules as data, and their application to a profile."""
