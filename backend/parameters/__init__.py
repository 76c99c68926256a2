"""Parameter sets as files, and as lists of other tools."""
