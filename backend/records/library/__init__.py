"""The library: parameter sets, recordings, measurements and reports, with versions and tags."""

from backend.axes.parameters.set_file import BadSet
from backend.records.library.catalogue import Library, NotInLibrary
from backend.records.library.folder import SetLibrary, SetStore
from backend.records.library.sets import LibrarySets

__all__ = ["BadSet", "Library", "LibrarySets", "NotInLibrary", "SetLibrary", "SetStore"]
