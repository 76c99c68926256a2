"""Parameter sets as files, and as lists in formats of other tools."""
