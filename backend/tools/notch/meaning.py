"""What notch values mean where no manual prints it: the result of measuring them."""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

from backend.analysis.loop.notch import (
    IntegerRange,
    LevelCalibration,
    Notch,
    decode_hz_levels,
    encode_hz_levels,
    encode_hz_width,
)
from backend.drive.drive import Drive


@dataclass(frozen=True)
class NotchMeaning:
    """Measured at ``centre_hz``.

    ``levels`` for families of levels; else the width in Hz is ``width_scale`` times the value and
    every notch is ``depth_db`` deep. ``left_out`` counts values that there was no time to try.
    """

    centre_hz: float
    levels: LevelCalibration | None = None
    width_scale: float = 1.0
    depth_db: float = 0.0
    left_out: int = 0

    def encoded(
        self, notch: Notch, frequency: IntegerRange, width: IntegerRange, depth: IntegerRange | None
    ) -> tuple[int, int, int | None]:
        """Raw frequency, width and depth that come nearest to a wanted notch.

        Raises:
            ValueError: the centre is outside the range.
        """
        if self.levels is not None and depth is not None:
            return encode_hz_levels(notch, frequency, width, self._known(depth), self.levels)
        # What was measured is a factor of the width that the value says.
        asked = Notch(notch.center_hz, notch.width_hz / self.width_scale, notch.depth_db)
        return *encode_hz_width(asked, frequency, width), None

    def _known(self, depth: IntegerRange) -> IntegerRange:
        """Levels beyond the ones that were tried are not trusted."""
        assert self.levels is not None
        tried = [level for level, _db in self.levels.depth_db]
        return IntegerRange(max(depth.low, min(tried)), min(depth.high, max(tried)))

    def decoded(
        self, raw: tuple[int, int, int | None], frequency: IntegerRange, width: IntegerRange
    ) -> Notch:
        """The notch that these raw values make.

        Raises:
            ValueError: they make none.
        """
        hz, wide, deep = raw
        centre_hz = frequency.value(hz)
        if self.levels is not None and deep is not None:
            return decode_hz_levels(centre_hz, wide, deep, self.levels)
        return Notch(centre_hz, width.value(max(wide, 1)) * self.width_scale, self.depth_db)


#: What was measured of the drives of this program, until it ends.
_MEASURED: WeakKeyDictionary[Drive, NotchMeaning] = WeakKeyDictionary()


def remember(drive: Drive, meaning: NotchMeaning) -> None:
    """Keep what was measured, for previews and designs of this drive."""
    _MEASURED[drive] = meaning


def meaning_of(drive: Drive) -> NotchMeaning | None:
    """What was measured of this drive's notches; None where nothing was."""
    return _MEASURED.get(drive)
