"""The library: parameter sets, recordings, measurements and reports, with versions and tags."""

from backend.library.folder import SetLibrary
from backend.parameter_set import BadSet

__all__ = ["BadSet", "SetLibrary"]
