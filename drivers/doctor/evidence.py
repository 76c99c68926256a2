"""State of a station and the exchange at the time of a refusal: typed facts, no words."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class SyncManagerState:
    """One sync manager: actual ``length``, and the ``expected`` one (None: not planned here)."""

    number: int
    start: int
    length: int
    control: int
    enabled: bool
    expected: int | None = None


@dataclass(frozen=True, slots=True)
class Counters:
    """Synchronisation counters of 1C32h or 1C33h (ETG.1020 table 59); None: not available."""

    missed: int | None = None
    cycle_too_small: int | None = None
    sync_error: int | None = None


@dataclass(frozen=True, slots=True)
class Evidence:
    """Facts of one EtherCAT station. Times in ns, sizes in bytes; None: could not be read.

    ``refused_key`` is the object whose write was refused, ``refused_code`` its abort code;
    ``from_file``: the write is an init command of the manufacturer's file.
    """

    station: int
    answers: bool = True
    wanted: str = "OP"
    al: int = 0
    al_code: int = 0
    timed_out: bool = False
    refused_key: str = ""
    refused_code: int | None = None
    from_file: bool = False
    managers: tuple[SyncManagerState, ...] = ()
    outputs: int | None = None
    inputs: int | None = None
    planned_outputs: int | None = None
    planned_inputs: int | None = None
    assigned: tuple[int, ...] = ()
    mandatory: tuple[int, ...] = ()
    activate: int | None = None
    planned_activate: int | None = None
    sync0_ns: int | None = None
    planned_sync0_ns: int | None = None
    sync0_pending: bool = False
    clock: bool = True
    watchdog_ns: int | None = None
    planned_watchdog_ns: int | None = None
    watchdog_expired: bool = False
    eeprom_busy: bool = False
    eeprom_error: bool = False
    mailbox: bool = True
    wkc: int | None = None
    planned_wkc: int | None = None
    late_frames: int = 0
    overruns: int = 0
    port_errors: int = 0
    lost_links: int = 0
    drive_error: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    known_vendor: int | None = None
    known_product: int | None = None
    known_revision: int | None = None
    aliases: tuple[int, ...] = ()
    """Aliases of all other stations of the segment."""
    alias: int = 0
    sm_counters: Counters = field(default_factory=Counters)
