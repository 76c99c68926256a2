"""One axis: power state, modes, units, gearing, process data, and restoring after a motion."""
