"""Conformance of a slave: rules of the public standards, tried over its own bus."""
