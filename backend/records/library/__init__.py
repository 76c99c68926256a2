"""The library: parameter sets, recordings, measurements and reports, with versions and tags."""

from backend.library.catalogue import Library, NotInLibrary
from backend.library.folder import SetLibrary, SetStore
from backend.library.sets import LibrarySets
from backend.parameters.set_file import BadSet

__all__ = ["BadSet", "Library", "LibrarySets", "NotInLibrary", "SetLibrary", "SetStore"]
