"""What a manufacturer's file prescribes on the way of an EtherCAT slave to Operational.

Source: ETG.2000 v1.0.10, clauses 6.4 (mailbox), 6.5 (sync managers), 6.7 (state machine), 6.9
(distributed clocks) and 6.12 (registers of the slave controller).
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from profiles.record import Frozen

Protocol = Literal["aoe", "eoe", "coe", "foe", "soe", "voe"]
SyncManagerKind = Literal["mailbox_out", "mailbox_in", "outputs", "inputs"]


class InitCommand(Frozen):
    """An object that the master writes on a transition of the state machine."""

    transition: str = Field(
        pattern=r"^[IPSOB]{2}$", description="first letters of the states: PS is Pre-Op to Safe-Op"
    )
    index: int = Field(ge=0x1000, le=0xFFFF)
    subindex: int = Field(ge=0, le=255)
    data: str = Field(pattern=r"^([0-9A-F]{2})*$", description="bytes as they travel, in hex")
    complete_access: bool = False
    fixed: bool = Field(default=False, description="the maker does not want it changed or removed")
    comment: str = ""

    @property
    def raw(self) -> bytes:
        """The data as transferred."""
        return bytes.fromhex(self.data)


class SyncManagerRule(Frozen):
    """One sync manager: sizes [bytes], start address and control byte (ETG.1000.4 clause 6.7)."""

    number: int = Field(ge=0, le=15)
    kind: SyncManagerKind
    start: int | None = None
    default_size: int | None = None
    min_size: int | None = None
    max_size: int | None = None
    control: int | None = Field(default=None, ge=0, le=255)
    enable: int | None = Field(default=None, ge=0, le=255)


class CoeRules(Frozen):
    """Flags of the CoE mailbox; None where the file does not state them."""

    sdo_info: bool | None = None
    pdo_assign: bool | None = Field(default=None, description="1C12h and 1C13h can be written")
    pdo_config: bool | None = Field(default=None, description="16xxh and 1Axxh can be written")
    pdo_upload: bool | None = Field(
        default=None, description="the mapping is to be read from the slave, not from the file"
    )
    complete_access: bool | None = None


class WatchdogRegisters(Frozen):
    """Values of 0400h (40 ns steps minus 2), 0410h and 0420h (in steps of the divider)."""

    divider: int | None = Field(default=None, ge=0, le=0xFFFF)
    pdi: int | None = Field(default=None, ge=0, le=0xFFFF)
    process_data: int | None = Field(default=None, ge=0, le=0xFFFF)

    @property
    def process_data_ns(self) -> int | None:
        """The process-data watchdog [ns]; None if the file states none, or disables it."""
        if not self.process_data:
            return None
        divider = 0x09C2 if self.divider is None else self.divider
        return 40 * (divider + 2) * self.process_data


class SyncSignal(Frozen):
    """Cycle [ns] of SYNC0 or SYNC1 and its shift [ns].

    ``cycle_ns`` 0 means the cycle of the process data times ``factor``, or divided by it if
    negative.
    """

    cycle_ns: int = Field(default=0, ge=0)
    factor: int = 1
    shift_ns: int = 0

    def period_ns(self, cycle_ns: int) -> int:
        """Return the cycle [ns] for process data with this cycle [ns]."""
        if self.cycle_ns:
            return self.cycle_ns
        if self.factor < 0:
            return cycle_ns // -self.factor
        return cycle_ns * max(self.factor, 1)


PLAIN_ACTIVATE = 0x0300
"""SYNC0 alone: for a drive whose profile has no operation mode."""


class ModePdos(Frozen):
    """The PDOs that an operation mode assigns to one sync manager."""

    sync_manager: int
    pdos: tuple[int, ...]


class ClockMode(Frozen):
    """An operation mode of the distributed clocks."""

    name: str
    description: str = ""
    assign_activate: int = Field(
        default=0, ge=0, le=0xFFFF, description="for 0980h; 0: without distributed clocks"
    )
    sync0: SyncSignal = SyncSignal()
    sync1: SyncSignal | None = None
    pdos: tuple[ModePdos, ...] = ()


class StateTimeouts(Frozen):
    """Time-outs of the slave [ms]; None where the file does not state them."""

    preop_ms: int | None = Field(default=None, ge=0)
    safeop_op_ms: int | None = Field(default=None, ge=0)
    back_to_init_ms: int | None = Field(default=None, ge=0)
    back_to_safeop_ms: int | None = Field(default=None, ge=0)
    mailbox_request_ms: int | None = Field(default=None, ge=0)
    mailbox_response_ms: int | None = Field(default=None, ge=0)


class BringUp(Frozen):
    """Everything that the file prescribes between Init and Operational."""

    protocols: tuple[Protocol, ...] = ()
    data_link_layer: bool = False
    coe: CoeRules = CoeRules()
    init_commands: tuple[InitCommand, ...] = ()
    sync_managers: tuple[SyncManagerRule, ...] = ()
    watchdog: WatchdogRegisters = WatchdogRegisters()
    clock_modes: tuple[ClockMode, ...] = ()
    timeouts: StateTimeouts = StateTimeouts()
    eeprom_bytes: int | None = None
    eeprom_config: str = Field(default="", pattern=r"^([0-9A-F]{2})*$")
    source: str

    def sync_manager(self, kind: SyncManagerKind) -> SyncManagerRule | None:
        """Return the first sync manager of this kind."""
        return next((each for each in self.sync_managers if each.kind == kind), None)

    @property
    def clock_mode(self) -> ClockMode | None:
        """The first mode with distributed clocks; None if there is none."""
        return next((mode for mode in self.clock_modes if mode.assign_activate), None)

    @property
    def assign_activate(self) -> int:
        """Value for 0980h; 0 (no SYNC0) if the file has modes but none with a clock."""
        mode = self.clock_mode
        if mode is None:
            return 0 if self.clock_modes else PLAIN_ACTIVATE
        return mode.assign_activate

    def mode_pdos(self, sync_manager: int) -> tuple[int, ...]:
        """Return the PDOs that the mode in use assigns to a sync manager; empty if not stated."""
        mode = self.clock_mode or next(iter(self.clock_modes), None)
        found = (
            (each.pdos for each in mode.pdos if each.sync_manager == sync_manager) if mode else ()
        )
        return next(iter(found), ())
