"""The scales of one axis: read once, and read again when what they rest on changes."""

from __future__ import annotations

from dataclasses import dataclass

from backend.axis.power import PowerState
from backend.drive.drive import Drive
from backend.drive.readings import Reading
from backend.scales.taught import Taught
from backend.scales.units import AxisUnits, read_units
from profiles.schema import Raw


@dataclass(frozen=True, slots=True)
class SmallMoves:
    """The small moves by increments so far: the last one, and the longest of all.

    ``raw_per_inc_s``: raw 606Ch per increment per second in the last one; None: not found.
    """

    moved: int
    longest: int
    raw_per_inc_s: float | None


class ScaledAxis(PowerState):
    """A power state whose positions and speeds have units."""

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive)
        self._units: AxisUnits | None = None
        self._taught: Taught | None = None
        self._unit_raws: dict[str, Raw | None] = {}
        #: None until one was made since this axis is connected.
        self.small_moves: SmallMoves | None = None
        drive.listeners.add(self._units_may_have_changed)

    async def units(self) -> AxisUnits:
        """Units with the present gearing, read once until `forget_scales`."""
        if self._units is None:
            units = await read_units(self.drive, self._taught)
            known = self.drive.readings
            self._unit_raws = {
                key: known[key].raw for key in self.drive.profile.unit_keys if key in known
            }
            self._units = units
        return self._units

    async def require_certain_scales(self) -> AxisUnits:
        """The units, where an envelope in them means what it says.

        Raises:
            ScaleUnknown: a scale is not certain: nothing may be moved by unit.
            DriveError: the objects that state them cannot be read.
        """
        units = await self.units()
        units.require_certain()
        return units

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
        self._units = None

    def _units_may_have_changed(self, readings: list[Reading]) -> None:
        """Whoever wrote the gearing (a page, a set, the panel): units are read again."""
        for reading in readings:
            known = self._unit_raws.get(reading.key)
            if known is not None and reading.raw is not None and reading.raw != known:
                self._units = None
