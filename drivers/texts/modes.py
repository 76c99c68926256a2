"""Names of the modes of operation, as messages of the catalogue."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.cia402 import Mode
from drivers.texts.message import Text

_CODES: Mapping[Mode, str] = {
    Mode.NONE: "mode.no-mode",
    Mode.PP: "mode.profile-position",
    Mode.VL: "mode.velocity",
    Mode.PV: "mode.profile-velocity",
    Mode.PT: "mode.profile-torque",
    Mode.HM: "mode.homing",
    Mode.IP: "mode.interpolated-position",
    Mode.CSP: "mode.cyclic-synchronous-position",
    Mode.CSV: "mode.cyclic-synchronous-velocity",
    Mode.CST: "mode.cyclic-synchronous-torque",
}


def mode_text(mode: Mode) -> Text:
    """The mode's name in CiA 402-2; in Chinese with the English name in brackets."""
    return Text(_CODES[mode])
