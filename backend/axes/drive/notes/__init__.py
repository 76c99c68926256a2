"""What is noted of a write: marks of change, listeners, values still to be restored."""
