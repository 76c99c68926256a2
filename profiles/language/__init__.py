"""Texts of the profiles in other languages, as overlays beside each profile."""
