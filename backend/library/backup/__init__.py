"""One archive of a station: database, sets and recordings, written, copied and restored."""
