"""The commands of the command line, one module per group; `base/` is what they share."""
