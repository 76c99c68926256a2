"""Name and network ports of a station in the cabinet."""
