"""Recordings: lossless to disk, kept through crashes and full disks, exported, and captured."""
