"""Checks before every route: rights, sessions, origin, sizes, rates."""
