"""Functions of a drive that a person operates: forced signals, terminals, gearing, braking."""
