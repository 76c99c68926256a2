"""Functions of a drive that a person sets: forced signals, terminals, gearing, braking."""
