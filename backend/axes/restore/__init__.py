"""Restore lists: values that are changed for the duration of a motion, stored on the disk."""
