"""Process data of one slave: exchanged at a SYNC pulse, or at the sync manager event of the frame.

With a SYNC pulse the physics run on the slave's own time grid and are computed lazily when a frame
arrives; if a frame is late, the outputs of the previous cycle stay in effect, as in a drive. With
SYNC1 and a faster SYNC0, outputs and inputs are exchanged at SYNC1, and SYNC0 is the drive's own
cycle (ETG.1020 clause 22, sync type 3).
"""

from __future__ import annotations

from drivers.virtual.device import Device, ProcessImage, SdoAbort
from drivers.virtual.wires.ethercat.controller.dc import DistributedClock
from drivers.virtual.wires.ethercat.controller.registers import AlCode
from drivers.virtual.wires.ethercat.controller.syncmanager import SyncManager
from drivers.virtual.wires.ethercat.mailbox.dictionary import CoeDictionary, SyncReport

_SHORTEST_CYCLE_NS = 31_250
"""Shortest cycle of our drives; a limit in the manual applies as well."""

_FREE_RUN, _SYNC_MANAGER, _SYNC0, _SYNC1 = 0, 1, 2, 3


class ProcessData:
    """Connects the mapping with sync managers 2 and 3 and with the time grid."""

    def __init__(
        self,
        device: Device,
        dictionary: CoeDictionary,
        report: SyncReport,
        clock: DistributedClock,
        *,
        outputs: SyncManager,
        inputs: SyncManager,
    ) -> None:
        self._device = device
        self._dictionary = dictionary
        self._report = report
        self._clock = clock
        self._outputs = outputs
        self._inputs = inputs
        self._rx: ProcessImage | None = None
        self._tx: ProcessImage | None = None
        self._latest = b""
        self._fresh = False
        self._running = False
        self._operational = False
        self._ticked_ns = -1
        self._seen_sync0 = False
        outputs.on_written = self._written
        self._now_ns = 0
        self.received = False
        """Outputs were received since Safe-Op was entered."""
        self.written_ns: int | None = None
        """Time of the last outputs; starts the watchdog."""
        self.interpolation_ns = 0
        """Period that the master had set in 60C2h when Safe-Op was entered; 0: none."""

    @property
    def has_outputs(self) -> bool:
        """Whether any output is mapped."""
        return self._rx is not None and self._rx.size > 0

    def check(self) -> int:
        """Check mapping, sync managers and clock before Safe-Op; return an AL status code or 0."""
        for direction, manager, mapping_code, config_code in (
            ("rx", self._outputs, AlCode.INVALID_OUTPUT_MAPPING, AlCode.INVALID_OUTPUT_CONFIG),
            ("tx", self._inputs, AlCode.INVALID_INPUT_MAPPING, AlCode.INVALID_INPUT_CONFIG),
        ):
            try:
                image = self._bind(direction)
            except SdoAbort:
                return mapping_code
            size = image.size if image else 0
            used = manager.length if manager.enabled else 0
            wrong_way = manager.writable != (direction == "rx") or manager.mailbox
            if used != size or (size and wrong_way):
                return config_code
        if self._clock.sync0_requested:
            return self._check_cycle()
        return AlCode.NONE

    def _check_cycle(self) -> int:
        if self._clock.sync0_cycle_ns == 0:
            return AlCode.INVALID_DC_CONFIG
        pdo = self._device.profile.pdo
        if self._clock.sync0_cycle_ns < _SHORTEST_CYCLE_NS:
            return AlCode.INVALID_SYNC_CYCLE
        cycle_us = self._clock.sync0_cycle_ns / 1000
        low = pdo.cycle_min_us if pdo else None
        high = pdo.cycle_max_us if pdo else None
        if (low is not None and cycle_us < low) or (high is not None and cycle_us > high):
            return AlCode.INVALID_SYNC_CYCLE
        return AlCode.NONE

    def _bind(self, direction: str) -> ProcessImage | None:
        entries = self._dictionary.assigned(direction)
        return self._device.map_process_data(list(entries), direction) if entries else None

    def start(self, now_ns: int) -> None:
        """Safe-Op: bind the mapping, unlock the sync managers, provide the first inputs."""
        self._rx, self._tx = self._bind("rx"), self._bind("tx")
        self._outputs.locked = self._inputs.locked = False
        self._latest, self._fresh, self.received = b"", False, False
        self._ticked_ns = now_ns
        self._running = True
        self._seen_sync0 = False
        self.written_ns = None
        self._report.mode = self._mode()
        self._report.cycle_ns = self._clock.exchange_cycle_ns
        self.interpolation_ns = self._interpolation_ns()
        self._device.advance(now_ns)
        self._latch()

    def _mode(self) -> int:
        if not self._clock.sync0_requested:
            return _SYNC_MANAGER
        return _SYNC0 if self._clock.sync1_delay_ns is None else _SYNC1

    def _interpolation_ns(self) -> int:
        try:
            value, exponent = (self._device.read(0x60C2, sub) for sub in (1, 2))
        except SdoAbort:
            return 0
        power = int.from_bytes(exponent, "little", signed=True)
        return round(int.from_bytes(value, "little") * 10.0 ** (9 + power))

    def stop(self) -> None:
        """Stop all exchange below Safe-Op."""
        self._running = self._operational = False
        self._outputs.locked = self._inputs.locked = True
        self._rx = self._tx = None
        self._report.mode = _FREE_RUN

    def operate(self, on: bool) -> None:
        """Apply outputs in Op; in Safe-Op they are received and ignored.

        Outputs from before a fall are never applied again: Op must be entered with new ones.
        """
        if self._operational and not on:
            self._latest, self._fresh, self.received = b"", False, False
        self._operational = on
        if on:
            self._report.missed = 0

    @property
    def synchronised(self) -> bool:
        """Whether SYNC0 has occurred since Safe-Op, or is not required."""
        return self._seen_sync0 or not self._clock.sync0_requested

    @property
    def operational(self) -> bool:
        """Whether outputs are applied and inputs latched at every SYNC0."""
        return self._operational

    @property
    def next_tick_ns(self) -> int | None:
        """Next SYNC0 or SYNC1 with work to do."""
        return self._clock.next_pulse(self._ticked_ns) if self._running else None

    def tick(self, now_ns: int) -> None:
        """Process a pulse at ``now_ns``: run the drive, exchange process data if due."""
        self._ticked_ns = now_ns
        self._seen_sync0 = True
        self._device.advance(now_ns)
        if self._operational:
            if not self._clock.exchanges_at(now_ns):
                return
            if not self._fresh and self.has_outputs:
                self._report.missed += 1
            self._fresh = False
            if self._rx is not None and self._latest:
                self._rx.unpack(self._latest)
        self._latch()

    def skip_to(self, now_ns: int) -> None:
        """Skip to the last SYNC0: outside Op a SYNC0 only latches inputs."""
        if self._operational:
            return
        last = self._clock.last_sync0(now_ns)
        if last is not None and last > self._ticked_ns:
            self.tick(last)

    def at(self, now_ns: int) -> None:
        """Set the time of the next access."""
        self._now_ns = now_ns

    def _written(self) -> None:
        self._latest = bytes(self._outputs.data)
        self._fresh = self.received = True
        self.written_ns = self._now_ns

    def after_frame(self, now_ns: int) -> None:
        """Without SYNC0, apply outputs and latch inputs at the sync manager event."""
        if not self._running or self._clock.sync0_requested:
            return
        if self._fresh or not self.has_outputs:
            self._device.advance(now_ns)
            if self._operational and self._rx is not None and self._fresh:
                self._rx.unpack(self._latest)
            self._fresh = False
            self._latch()

    def _latch(self) -> None:
        if self._tx is not None:
            self._inputs.data[:] = self._tx.pack()
