"""One drive: state, parameters, motion, functions, terminals, pending restores."""
