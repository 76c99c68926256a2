"""The process that owns one segment, and its stations."""
