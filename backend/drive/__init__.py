"""One drive: identity, ports, readings, writes, faults, terminals, and what waits to be restored."""
