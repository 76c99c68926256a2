"""Everything that a report shows, in any language, before it has a form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from backend.health.records import Condition
from backend.tools.autotune.result import VerdictInfo
from backend.tools.tool import ToolResult
from drivers.texts.message import Text


@dataclass(frozen=True)
class Identity:
    """Who the axis is; None or empty where it is not known."""

    axis: str
    drive: str
    manual: str
    profile_version: str
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    serial: int | None = None
    firmware: str = ""
    buses: tuple[str, ...] = ()


@dataclass(frozen=True)
class ChangedSetting:
    """One parameter before commissioning and after, as text with its unit.

    ``now`` is empty where the drive still has it so, else what it has instead.
    """

    key: str
    name: str
    before: str
    after: str
    time: datetime
    now: str = ""


@dataclass(frozen=True)
class HandedOverFile:
    """A start-up list that was made for the machine's controller.

    ``values`` are key, name and value with unit; ``changed`` those of them that the drive holds
    otherwise now, with what it holds.
    """

    time: datetime
    person: str
    format: str
    file: str
    sha256: str
    set_file: str
    values: tuple[tuple[str, str, str], ...]
    changed: tuple[tuple[str, str, str, str], ...] = ()


@dataclass(frozen=True)
class Measured:
    """A measurement evaluated again. ``earlier`` is the same kind before the first change.

    ``differences`` names what another version of the program concluded otherwise at the time.
    """

    file: str
    kind: str
    saved: datetime
    program: str
    differences: tuple[str, ...]
    settings: Mapping[str, object]
    view: ToolResult
    earlier: Measured | None = None
    verdict: VerdictInfo | None = None
    """On a tuned loop, over all frequencies; None where no tuning verified it."""


@dataclass(frozen=True)
class Facts:
    """``unsaved`` and ``pending`` name parameters; ``trouble`` is what the drive
    and the station report.

    ``last_change`` is None where nothing was changed.
    """

    identity: Identity
    made: datetime
    program: str
    person: str = ""
    machine: str = ""
    notes: str = ""
    changes: tuple[ChangedSetting, ...] = ()
    last_change: datetime | None = None
    measured: tuple[Measured, ...] = ()
    unusable: tuple[Text, ...] = ()
    unsaved: tuple[str, ...] = ()
    pending: tuple[str, ...] = ()
    trouble: tuple[Text, ...] = ()
    handed_over: tuple[HandedOverFile, ...] = ()
    condition: Condition | None = None
    #: Whether the drive was asked; a report of files alone has no data of its settings.
    live: bool = True
