"""One module per family, named as its profile: all that a virtual drive of it does by itself.

A module has one function, ``family(profile)``, which answers the `Family` of that profile. A new
family is one more module; nothing else lists them.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pkgutil import iter_modules

from drivers.virtual.firmware.cia402.base import Family
from profiles.schema import Profile


def names() -> list[str]:
    """Families with a virtual drive, in the order of the alphabet."""
    return sorted(module.name for module in iter_modules(__path__))


def family_of(profile: Profile, name: str) -> Family:
    """What the drives of the family ``name`` do, with this profile.

    Raises:
        KeyError: no such family.
    """
    if name not in names():
        raise KeyError(name)
    build: Callable[[Profile], Family] = import_module(f"{__name__}.{name}").family
    return build(profile)
