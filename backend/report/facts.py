"""The contents of a report, independent of language and layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from backend.tools.tool import ToolResult
from backend.tools.tuning.autotune.result import VerdictInfo
from backend.tools.watching.trend.records import Condition
from drivers.texts.message import Text


@dataclass(frozen=True)
class Identity:
    """Identity of the axis; None or empty where it is not known."""

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
    """One parameter before and after commissioning, as text with its unit.

    ``now``: the present value where it differs from ``after``; otherwise, or where it was not read,
    empty.
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

    ``values``: key, name and value with unit. ``changed``: key, name, value and present value of
    parameters whose value in the drive differs now.
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
    """A measurement, evaluated again. ``earlier``: one of the same kind before the first change.

    ``differences``: fields whose stored result, of another version of the program, differs.
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
    """Verdict on a tuned loop over all frequencies; None where no tuning verified it."""


@dataclass(frozen=True)
class Facts:
    """All facts of a report.

    ``unsaved``, ``pending``: parameters not saved in the drive, or not in effect yet. ``trouble``:
    problems reported by drive and station. ``last_change``: None where nothing was changed.
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
    #: Whether the drive was read; a report from files alone has no data of its settings.
    live: bool = True
