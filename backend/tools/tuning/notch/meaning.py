"""Measured effect of notch values that no manual documents."""

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
from backend.axes.drive.drive import Drive


@dataclass(frozen=True)
class NotchMeaning:
    """Effect of notch values, measured at ``centre_hz``.

    ``levels`` is for families with levels; otherwise the width in Hz is ``width_scale`` times the
    value and every notch has the depth ``depth_db``. ``left_out`` counts values that were not tried
    for lack of time.
    """

    centre_hz: float
    levels: LevelCalibration | None = None
    width_scale: float = 1.0
    depth_db: float = 0.0
    left_out: int = 0

    def encoded(
        self, notch: Notch, frequency: IntegerRange, width: IntegerRange, depth: IntegerRange | None
    ) -> tuple[int, int, int | None]:
        """Raw frequency, width and depth of the nearest possible notch.

        Raises:
            ValueError: the centre is outside the range.
        """
        if self.levels is not None and depth is not None:
            return encode_hz_levels(notch, frequency, width, self._known(depth), self.levels)
        # The measurement yields a factor of the nominal width.
        asked = Notch(notch.center_hz, notch.width_hz / self.width_scale, notch.depth_db)
        return *encode_hz_width(asked, frequency, width), None

    def _known(self, depth: IntegerRange) -> IntegerRange:
        """Depth levels within those that were tried; others are not trusted."""
        assert self.levels is not None
        tried = [level for level, _db in self.levels.depth_db]
        return IntegerRange(max(depth.low, min(tried)), min(depth.high, max(tried)))

    def decoded(
        self, raw: tuple[int, int, int | None], frequency: IntegerRange, width: IntegerRange
    ) -> Notch:
        """The notch that these raw values define.

        Raises:
            ValueError: they define none.
        """
        hz, wide, deep = raw
        centre_hz = frequency.value(hz)
        if self.levels is not None and deep is not None:
            return decode_hz_levels(centre_hz, wide, deep, self.levels)
        return Notch(centre_hz, width.value(max(wide, 1)) * self.width_scale, self.depth_db)


#: Effects measured on the drives of this process, until it ends.
_MEASURED: WeakKeyDictionary[Drive, NotchMeaning] = WeakKeyDictionary()


def remember(drive: Drive, meaning: NotchMeaning) -> None:
    """Store the measured effect, for previews and designs of this drive."""
    _MEASURED[drive] = meaning


def meaning_of(drive: Drive) -> NotchMeaning | None:
    """Measured effect of this drive's notches; None where not measured."""
    return _MEASURED.get(drive)
