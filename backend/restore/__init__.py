"""The restore lists: values that are changed for the length of a motion, kept on the disk."""
