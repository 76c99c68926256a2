"""Supply, cable or person end a tuning in the middle of a motion, at the second and third of each.

Without a wire; a few out of what `tests.virtual.tools.strike` tries as a script.
"""

from __future__ import annotations

import pytest

from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.strike import Known, axis_of, measured, struck

#: What comes before a part, once for each axis.
_KNOWN: dict[tuple[str, bool], Known] = {}


async def known_of(drive: str, spec: MechanicsSpec, *, vertical: bool) -> Known:
    if (drive, vertical) not in _KNOWN:
        _KNOWN[drive, vertical] = await measured(drive, spec)
    return _KNOWN[drive, vertical]


@pytest.mark.long
@pytest.mark.parametrize("kind", ["control power", "main power"])
@pytest.mark.parametrize(
    ("drive", "part", "number"),
    [
        # The long moves; the third motion without a loop, a doublet or a realisation.
        ("r6l", "inertia", 2),
        ("m6l", "sweep", 6),
        ("mms7", "sweep", 5),
    ],
)
async def test_a_supply_that_fails(drive: str, part: str, number: int, kind: str) -> None:
    assert await struck(drive, axis_of(vertical=False), part, number, kind)


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "vertical", "number", "kind"),
    [
        ("r6l", False, 1, "control power"),
        ("r6l", False, 3, "cable"),
        ("r6l", False, 3, "cancelled"),
        ("m6l", True, 2, "control power"),
        ("m6l", True, 3, "main power"),
        ("m6l", True, 3, "cancelled"),
    ],
)
async def test_trouble_while_notches_are_learned(
    drive: str, vertical: bool, number: int, kind: str
) -> None:
    """Free and with the loop that holds a load, without a notch and with the first ones."""
    spec = axis_of(vertical=vertical)
    known = await known_of(drive, spec, vertical=vertical)
    assert await struck(drive, spec, "notches", number, kind, known)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["cable", "cancelled"])
@pytest.mark.parametrize("number", [5, 7])
async def test_later_realisations(number: int, kind: str) -> None:
    assert "realisation" in await struck("r6l", axis_of(vertical=False), "sweep", number, kind)
