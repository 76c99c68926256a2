"""Texts of the profiles in other languages, as overlays next to each profile."""
