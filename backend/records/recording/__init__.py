"""Recordings as files that stay readable after crashes and full disks: writing, reading, export."""
