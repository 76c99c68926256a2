"""One running server: buses, connected drives, exchanges, records."""
