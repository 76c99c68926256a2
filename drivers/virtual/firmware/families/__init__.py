"""One module per family, named as its profile, with the specific behaviour of its virtual drive.

A module has one function, ``family(profile)``, which returns the `Family` of that profile. A new
family needs only one more module; there is no other list.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules

from drivers.virtual.firmware.cia402.base import Family
from profiles.schema import Profile


def names() -> list[str]:
    """Return families with a virtual drive, in alphabetical order."""
    return sorted(module.name for module in iter_modules(__path__))


def family_of(profile: Profile, name: str) -> Family:
    """Return the behaviour of the family ``name`` with this profile.

    Raises:
        KeyError: no such family.
    """
    if name not in names():
        raise KeyError(name)
    build: Callable[[Profile], Family] = import_module(f"{__name__}.{name}").family
    return build(profile)
