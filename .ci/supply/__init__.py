"""Locked packages, bill of materials and notice: see `supply.__main__`."""
