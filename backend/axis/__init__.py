"""One axis: power state, modes, units, gearing, process data, and the contexts that restore it."""
