"""The restore lists: values that are borrowed for the length of a motion, kept on the disk."""
