"""Pure analysis on arrays: no drives, no buses, no I/O."""
