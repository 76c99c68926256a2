"""The scales of one axis: read once, and read again when what they rest on changes."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from backend.axis.power import PowerState
from backend.drive.drive import Drive
from backend.drive.readings import Reading
from backend.motion.grant import Grant
from backend.scales.resolve import stating_keys
from backend.scales.scale import ScaleChanged
from backend.scales.taught import Taught
from backend.scales.units import AxisUnits, read_units
from drivers.errors import DriveError
from profiles.schema import Raw

#: One motion relies so long on its last look at the scales. A look takes some ten reads, and a
#: server compares the scales of an axis with power every 0.9 s anyway.
JUST_LOOKED_S = 5.0


@dataclass(frozen=True, slots=True)
class SmallMoves:
    """The small moves by increments so far: the last one, and the longest of all.

    ``raw_per_inc_s``: raw 606Ch per increment per second in the last one; None: not found.
    """

    moved: int
    longest: int
    raw_per_inc_s: float | None


@dataclass(frozen=True, slots=True)
class _Planned:
    """The units by which a motion was planned; ``grant`` is that of the whole motion."""

    grant: Grant | None
    units: AxisUnits


class ScaledAxis(PowerState):
    """A power state whose positions and speeds have units."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive)
        self._units: AxisUnits | None = None
        self._taught: Taught | None = None
        self._unit_raws: dict[str, Raw | None] = {}
        self._planned: _Planned | None = None
        #: Objects of the scales that the drive refused as absent, until `forget_scales`.
        self._absent: frozenset[str] = frozenset()
        #: The motion (its grant) that looked at the scales last before power, and when.
        self._looked: tuple[Grant | None, float] = (None, -math.inf)
        #: None until one was made since this axis is connected, or since its scales changed.
        self.small_moves: SmallMoves | None = None
        #: Called with the keys of objects of the scales that have other values than they had.
        self.scales_changed: Callable[[list[str]], None] = lambda _keys: None
        drive.listeners.add(self._units_may_have_changed)

    async def units(self) -> AxisUnits:
        """Units with the present gearing, read once until `forget_scales`."""
        if self._units is None:
            units = await read_units(self.drive, self._taught, self._absent)
            known = self.drive.readings
            self._absent = frozenset(
                key
                for key in stating_keys(self.drive)
                if key not in known or known[key].raw is None
            )
            raws = {key: known[key].raw for key in self.drive.profile.unit_keys if key in known}
            before, self._unit_raws, self._units = self._unit_raws, raws, units
            if before and raws != before:
                # An increment is another one now: how far the last moves went says nothing.
                self.small_moves = None
                self.scales_changed(
                    sorted(key for key in raws | before if raws.get(key) != before.get(key))
                )
            return units
        return self._units

    async def read_scales(self) -> AxisUnits:
        """Units with the gearing that the drive has now, read from it: others may change it.

        Raises:
            DriveError: the objects that state them cannot be read.
        """
        self._units = None
        return await self.units()

    async def require_certain_scales(self) -> AxisUnits:
        """The units, read now, where an envelope in them means what it says.

        Within one motion (a grant of the calling work) they must be those that it began with:
        places and setpoints were computed by them.

        Raises:
            ScaleUnknown: a scale is not certain: nothing may be moved by unit.
            ScaleChanged: the drive has other scales than at the begin of this motion.
            DriveError: the objects that state them cannot be read.
        """
        whole = self.drive.authority.outermost(self.drive.id)
        units = await (self.units() if self._just_looked(whole) else self.read_scales())
        units.require_certain()
        planned = self._planned
        if whole is not None and planned is not None and planned.grant is whole:
            self._require_same(planned.units, units)
        self._planned = _Planned(whole, units)
        return units

    async def require_planned_scales(self) -> None:
        """The last look before the axis gets power: the scales are those of the plan.

        Raises:
            ScaleUnknown, ScaleChanged, DriveError: as `require_certain_scales`.
        """
        whole, planned = self.drive.authority.outermost(self.drive.id), self._planned
        before = self._units
        if planned is not None and planned.grant is whole:
            before = planned.units
        if self._just_looked(whole):
            units = await self.units()
        else:
            units = await self.read_scales()
            self._looked = (whole, time.monotonic())
        units.require_certain()
        if before is not None:
            self._require_same(before, units)

    def _just_looked(self, whole: Grant | None) -> bool:
        """Whether this motion has looked at the scales before power, a short time ago."""
        grant, at_s = self._looked
        return whole is not None and grant is whole and time.monotonic() - at_s < JUST_LOOKED_S

    def _require_same(self, before: AxisUnits, now: AxisUnits) -> None:
        if now.scales != before.scales:
            raise ScaleChanged("scales.changed", drive=self.drive.name)

    async def look_at_scales(self) -> None:
        """Ask again for what the scales rest on; never raises. `scales_changed` reports changes."""
        known = list(self._unit_raws)
        with contextlib.suppress(DriveError):
            if known:
                await self.drive.read_many(known)
            await self.units()

    @property
    def known_units(self) -> AxisUnits | None:
        """Units as they were read last; None before that, and after the gearing changed."""
        return self._units

    @property
    def taught(self) -> Taught | None:
        """What a person has said of the scales of this axis."""
        return self._taught

    def teach(self, taught: Taught | None) -> None:
        """Scales as a person states or confirms them; they count from the next motion on."""
        self._taught = taught
        self.forget_scales()

    def moved_small(self, moved: int, raw_per_inc_s: float | None) -> None:
        """A small move by increments has ended well."""
        before = 0 if self.small_moves is None else self.small_moves.longest
        self.small_moves = SmallMoves(moved, max(abs(moved), before), raw_per_inc_s)

    def forget_scales(self) -> None:
        """The gearing changed, or may have: it is read before the next use."""
        self._units, self._absent = None, frozenset()

    def _units_may_have_changed(self, readings: list[Reading]) -> None:
        """Whoever wrote the gearing (a page, a set, the panel): units are read again."""
        for reading in readings:
            known = self._unit_raws.get(reading.key)
            if known is not None and reading.raw is not None and reading.raw != known:
                self._units = None
