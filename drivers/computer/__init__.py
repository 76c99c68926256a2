"""The computer that servodeck runs on: what differs between Linux, macOS and Windows.

Files, processes, terminals and sockets behind functions that exist on every system. Where a system
lacks something, the function says so by a typed error with its remedy, never by an ImportError.
"""
