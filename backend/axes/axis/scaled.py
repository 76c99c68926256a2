"""The scales of one axis: read once, and again when the objects that define them change."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from backend.axes.axis.power import PowerState
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.motion.grant import Grant
from backend.axes.scales.resolve import stating_keys
from backend.axes.scales.scale import ScaleChanged, Scales
from backend.axes.scales.taught import Taught
from backend.axes.scales.units import AxisUnits, read_units
from drivers.errors import DriveError
from drivers.texts.message import Text
from profiles.schema import Raw

#: Time for which one motion relies on its last reading of the scales [s]. A reading takes some ten
#: requests, and a server compares the scales of an axis with power every 0.9 s anyway.
JUST_LOOKED_S = 5.0


@dataclass(frozen=True, slots=True)
class SmallMoves:
    """The small moves by increments so far: the last and the longest one [increments].

    ``raw_per_inc_s``: raw 606Ch per increment per second in the last one; None: not determined.
    """

    moved: int
    longest: int
    raw_per_inc_s: float | None


@dataclass(frozen=True, slots=True)
class _Planned:
    """The units by which a motion was planned; ``grant`` is the outermost grant of the motion."""

    grant: Grant | None
    units: AxisUnits


class ScaledAxis(PowerState):
    """Power state of one axis, with units for its positions and speeds."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive)
        self._units: AxisUnits | None = None
        self._taught: Taught | None = None
        self._not_used: Text | None = None
        self._unit_raws: dict[str, Raw | None] = {}
        self._planned: _Planned | None = None
        #: Objects of the scales that the drive refused as absent, until `forget_scales`.
        self._absent: frozenset[str] = frozenset()
        #: Grant of the motion that last checked the scales before power, and the time (monotonic).
        self._looked: tuple[Grant | None, float] = (None, -math.inf)
        #: None until a small move is made after the connection or the last change of scales.
        self.small_moves: SmallMoves | None = None
        #: Called with the keys of those objects of the scales whose values changed.
        self.scales_changed: Callable[[list[str]], None] = lambda _keys: None
        drive.listeners.add(self._units_may_have_changed)

    async def units(self) -> AxisUnits:
        """Units with the present gearing; read from the drive where none are known."""
        if self._units is None:
            units = await read_units(self.drive, self._taught, self._absent)
            if self._not_used is not None:
                stated = Scales(*(replace(s, not_used=self._not_used) for s in units.scales.all))
                units = replace(units, stated=stated)
            known = self.drive.readings
            self._absent = frozenset(
                key
                for key in stating_keys(self.drive)
                if key not in known or known[key].raw is None
            )
            raws = {key: known[key].raw for key in self.drive.profile.unit_keys if key in known}
            before, self._unit_raws, self._units = self._unit_raws, raws, units
            if before and raws != before:
                # The increment has changed: the lengths of earlier small moves are no longer valid.
                self.small_moves = None
                self.scales_changed(
                    sorted(key for key in raws | before if raws.get(key) != before.get(key))
                )
            return units
        return self._units

    async def read_scales(self) -> AxisUnits:
        """Units with the gearing read from the drive now, as other programs may change it.

        Raises:
            DriveError: the objects of the scales cannot be read.
        """
        self._units = None
        return await self.units()

    async def require_certain_scales(self) -> AxisUnits:
        """The units, read now, where all scales are certain, so that an envelope in them holds.

        Within one motion (a grant of the calling work) they must be those that it began with, as
        its positions and setpoints were computed by them.

        Raises:
            ScaleUnknown: a scale is not certain, so no motion by unit is permitted.
            ScaleChanged: the drive has other scales than at the beginning of this motion.
            DriveError: the objects of the scales cannot be read.
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
        """Check, last before the axis gets power, that the scales are those of the plan.

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
        """Whether this motion has checked the scales less than `JUST_LOOKED_S` ago."""
        grant, at_s = self._looked
        return whole is not None and grant is whole and time.monotonic() - at_s < JUST_LOOKED_S

    def _require_same(self, before: AxisUnits, now: AxisUnits) -> None:
        if now.scales != before.scales:
            raise ScaleChanged("scales.changed", drive=self.drive.name)

    async def look_at_scales(self) -> None:
        """Read the objects of the scales again; a change is reported by `scales_changed`.

        Raises no DriveError.
        """
        known = list(self._unit_raws)
        with contextlib.suppress(DriveError):
            if known:
                await self.drive.read_many(known)
            await self.units()

    @property
    def known_units(self) -> AxisUnits | None:
        """Units as read last; None before the first reading and after a change of the gearing."""
        return self._units

    @property
    def taught(self) -> Taught | None:
        """Scales of this axis that a person stated or confirmed."""
        return self._taught

    def teach(self, taught: Taught | None, not_used: Text | None = None) -> None:
        """Set the scales that a person states or confirms; they apply from the next motion on.

        ``not_used``: why those that are stored under the name of this axis do not count.
        """
        self._taught, self._not_used = taught, not_used
        self.forget_scales()

    def moved_small(self, moved: int, raw_per_inc_s: float | None) -> None:
        """Record a small move by increments that ended without error."""
        before = 0 if self.small_moves is None else self.small_moves.longest
        self.small_moves = SmallMoves(moved, max(abs(moved), before), raw_per_inc_s)

    def forget_scales(self) -> None:
        """Discard the units, as the gearing may have changed; the next use reads it again."""
        self._units, self._absent = None, frozenset()

    def _units_may_have_changed(self, readings: list[Reading]) -> None:
        """Discard the units where a reading differs, whoever wrote it (page, set, drive panel)."""
        for reading in readings:
            known = self._unit_raws.get(reading.key)
            if known is not None and reading.raw is not None and reading.raw != known:
                self._units = None
