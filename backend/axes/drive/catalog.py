"""Functions of a drive: those of its profile, completed from the standard objects of CiA 402.

A profile's own description has priority. Drives imported from a description file have none, and
still get the pages that the standard objects make possible.
"""

from __future__ import annotations

from profiles.functions import (
    FaultHistory,
    Functions,
    HistorySlot,
    ParameterGroup,
    Probe,
    TouchProbe,
)
from profiles.schema import Profile

#: Option codes and the deceleration they refer to (CiA 402-2 clause 8.4 and 605Ah to 605Eh).
_STOPPING = ("605A:00", "605B:00", "605C:00", "605D:00", "605E:00", "6085:00")
_MODULO = ("607B:01", "607B:02", "60F2:00")


def functions_of(profile: Profile) -> Functions:
    """The profile's functions, completed from the standard objects."""
    own = profile.functions
    pages = {(group.page, group.name) for group in own.groups}
    groups = list(own.groups)
    for name, title, keys in (
        ("stopping", "Stopping", _STOPPING),
        ("modulo", "Modulo positioning", _MODULO),
    ):
        present = tuple(key for key in keys if key in profile.by_key)
        if present and ("motion", name) not in pages:
            groups.append(ParameterGroup(name=name, page="motion", title=title, keys=present))
    return own.model_copy(
        update={
            "groups": tuple(groups),
            "history": own.history or _error_field(profile),
            "probe": own.probe or _standard_probe(profile),
        }
    )


def _error_field(profile: Profile) -> FaultHistory | None:
    """Fault history in 1003h, newest in subindex 1; low word: code (CiA 301 clause 7.5.2.4)."""
    keys = [f"1003:{sub:02X}" for sub in range(1, 0xFF) if f"1003:{sub:02X}" in profile.by_key]
    if not keys:
        return None
    return FaultHistory(
        kind="slots",
        size=len(keys),
        slots=tuple(HistorySlot(code_key=key) for key in keys),
        source="CiA 301, 1003h",
    )


def _standard_probe(profile: Profile) -> TouchProbe | None:
    """Touch probes of 60B8h to 60BDh (CiA 402-2 clause 8.10); the maker defines the source bits."""
    if not {"60B8:00", "60B9:00"} <= profile.by_key.keys():
        return None

    def probe(rising: str, falling: str) -> Probe | None:
        if rising not in profile.by_key and falling not in profile.by_key:
            return None
        return Probe(
            sources={0: "probe input", 1: "index of the encoder"},
            rising_key=rising if rising in profile.by_key else None,
            falling_key=falling if falling in profile.by_key else None,
        )

    found = [probe("60BA:00", "60BB:00"), probe("60BC:00", "60BD:00")]
    return TouchProbe(
        function_key="60B8:00",
        status_key="60B9:00",
        probes=tuple(each for each in found if each is not None),
        source="CiA 402-2, 60B8h",
    )
