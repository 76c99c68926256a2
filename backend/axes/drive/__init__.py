"""One drive: identity, ports, readings, writes, faults, terminals, pending restores."""
