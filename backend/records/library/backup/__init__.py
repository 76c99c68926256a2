"""Backup and restore of a station as one archive: database, sets and recordings."""
