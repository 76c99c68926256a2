"""Conformance of a slave: rules of the public standards, tested over its own bus."""
