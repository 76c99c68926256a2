"""The computer that servodeck runs on: differences between Linux, macOS and Windows.

Files, processes, terminals and sockets behind functions that exist on every system. Where a system
lacks something, the function raises a typed error with its remedy, never an ImportError.
"""
