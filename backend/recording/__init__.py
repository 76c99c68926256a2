"""Recordings as files: written without loss through crashes and full disks, read, exported."""
