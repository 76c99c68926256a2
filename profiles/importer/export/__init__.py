"""Export of a profile as a description file for other programs."""
