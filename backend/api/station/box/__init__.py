"""Routes of the name and network ports of a station in the cabinet."""
