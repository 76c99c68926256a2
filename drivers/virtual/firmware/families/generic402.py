"""Any other CiA 402 drive: 1010h and 1011h with the texts of CiA 301."""

from __future__ import annotations

from drivers.virtual.firmware.cia402.base import Traits
from drivers.virtual.firmware.cia402.standard import Cia402
from profiles.schema import Profile

#: Any other CiA 402 drive: 1010h and 1011h with the texts of CiA 301.
TRAITS = Traits(
    commands={"1010:01": {0x65766173: "save"}, "1011:01": {0x64616F6C: "restore"}},
)


class Generic402(Cia402):
    """Behaviour of these drives in addition to their profile."""

    TRAITS = TRAITS


def family(profile: Profile) -> Generic402:
    """Return the family described by this profile."""
    return Generic402(profile)
