"""Objects of a drive: their bytes, their description, the dialect of a family, SDO abort codes."""
