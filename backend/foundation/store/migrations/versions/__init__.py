"""Revisions of the database, one branch for each part of the program."""
