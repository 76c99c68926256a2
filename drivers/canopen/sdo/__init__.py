"""SDO transfers: the protocol without I/O, one transfer at a time per node, and the node search."""
