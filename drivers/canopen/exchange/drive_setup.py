"""Set-up of drives for process data, and its undo. Blocking; runs on a worker thread."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from drivers.canopen.exchange.fixed_pdo import PDOS, FixedPdo
from drivers.canopen.exchange.pdo import INVALID, SYNCHRONOUS, PdoPlan, SdoWrite, set_up
from drivers.canopen.frames import TPDO
from drivers.canopen.sdo.transfers import fitted
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, Rejected
from drivers.motion.interpolation import interpolation_period
from drivers.texts.message import Text, joined, text

WATCHDOG_MS = 200
_PDO_FLAGS = 0x60000000

ReadObject = Callable[[int, int, int], bytes]
"""Reads (station, index, subindex), blocking."""

WriteObject = Callable[[int, int, int, bytes], None]
"""Writes (station, index, subindex, data), blocking."""


class DriveSetup:
    """Changes drives and records how to undo the changes."""

    def __init__(self, read: ReadObject, write: WriteObject, own_id: int) -> None:
        self._read = read
        self._write = write
        self._own_id = own_id
        self._undo: list[tuple[int, SdoWrite]] = []

    def map_pdos(self, pdos: Sequence[PdoPlan]) -> None:
        """Map these PDOs, and disable the other input PDOs of their stations.

        Raises:
            NotAllowed: a drive refuses the mapping of a signal; the message names it.
        """
        for station in sorted({p.station for p in pdos}):
            used = {p.number for p in pdos if (p.station, p.direction) == (station, "tx")}
            self._silence_others(station, used)
        for pdo in pdos:
            if pdo.fixed is None:
                self._map(pdo)
            else:
                self._take_over(pdo, pdo.fixed)

    def guard(self, station: int) -> bool:
        """Make the drive monitor our heartbeat; return False if it has no consumer (1016h)."""
        value = (self._own_id << 16 | WATCHDOG_MS).to_bytes(4, "little")
        try:
            self._change(station, SdoWrite(0x1016, 1, value))
        except Rejected:
            return False
        return self._read(station, 0x1016, 1) == value

    def interpolate(self, station: int, cycle_s: float) -> None:
        """Write the time between setpoints (60C2h) to a drive that interpolates between them."""
        begin = len(self._undo)
        try:
            value, exponent = interpolation_period(round(cycle_s * 1e9))
            self._change(station, SdoWrite(0x60C2, 1, bytes([value])))
            power = exponent.to_bytes(1, "little", signed=True)
            if fitted(self._read(station, 0x60C2, 2), 1) != power:
                self._change(station, SdoWrite(0x60C2, 2, power))
        except (Rejected, NotAllowed):
            # No interpolation, or not over this time: the drive keeps its own. The new value with
            # the old exponent would be another time.
            self._put_back(self._undo[begin:])

    def unguard(self) -> None:
        """Undo `guard`: before the heartbeat ends, or the drives would report a fault."""
        self._put_back([each for each in self._undo if each[1].index == 0x1016])

    def undo(self) -> None:
        """Restore all settings.

        Raises:
            NotAllowed: something could not be restored; the message lists it.
            LinkLost: the bus is gone; what is left is restored by the next call.
        """
        self._put_back(list(self._undo))

    def _change(self, station: int, write: SdoWrite) -> None:
        before = fitted(self._read(station, write.index, write.subindex), len(write.data))
        self._undo.append((station, SdoWrite(write.index, write.subindex, before)))
        try:
            self._write(station, write.index, write.subindex, write.data)
        except Rejected:
            self._undo.pop()  # unchanged
            raise

    def _silence_others(self, station: int, used: Collection[int]) -> None:
        """Disable the input PDOs that are not ``used``: they load the bus without a signal of ours.

        Of those beyond the pre-defined four, the first that the drive does not have is the end.
        """
        for number in range(PDOS):
            if number in used:
                continue
            if not self._silence(station, 0x1800 + number) and number >= len(TPDO):
                return

    def _silence(self, station: int, communication: int) -> bool:
        """Disable an input PDO; return whether the drive has it."""
        try:
            cob = int.from_bytes(self._read(station, communication, 1), "little")
        except Rejected:
            return False  # nothing to disable
        if not cob & INVALID:
            closed = (cob | INVALID).to_bytes(4, "little")
            self._tried(station, SdoWrite(communication, 1, closed))
        return True

    def _map(self, pdo: PdoPlan) -> None:
        station = pdo.station
        changed: set[int] = set()
        try:
            cob = self._read(station, pdo.communication, 1)
            writes = set_up(pdo, int.from_bytes(cob, "little") & _PDO_FLAGS)
            self._remember(pdo, cob)
            # The identifier cannot be changed while the PDO is valid (CiA 301 clause 7.5.2.35).
            for write in [_closed(pdo, cob), *writes]:
                self._write(station, write.index, write.subindex, write.data)
                changed.add(write.index)
            self._undo.append((station, writes[0]))  # before its identifier is changed back
        except Rejected as refusal:
            # What is fixed is unchanged, and would refuse to be restored.
            unchanged = {pdo.communication, pdo.mapping} - changed
            self._undo = [(s, w) for s, w in self._undo if s != station or w.index not in unchanged]
            names = ", ".join(str(s.address) for s in pdo.signals)
            raise NotAllowed(
                "canopen.node-not-let-mapped",
                drive=text("canopen.node", node=station),
                parameter=refusal.parameter,
                node=station,
                names=names,
                pdo_number=pdo.number + 1,
                cause=refusal.text,
            ) from refusal

    def _take_over(self, pdo: PdoPlan, fixed: FixedPdo) -> None:
        """Use a PDO as the drive has it; only identifier and transmission type may be changed.

        Raises:
            NotAllowed: its contents differ from its file, or it cannot be used with SYNC.
        """
        station = pdo.station
        held = self._held(station, pdo.mapping)
        same = len(held) == len(fixed.words) and all(
            have == want or (want is None and have & 0xFF == 8 * size)
            for have, want, (_, size) in zip(held, fixed.words, fixed.entries, strict=False)
        )
        if not same:
            raise NotAllowed(
                "canopen.fixed-pdo-differs",
                drive=text("canopen.node", node=station),
                parameter=f"{pdo.mapping:04X}:00",
                node=station,
                pdo_number=pdo.number + 1,
                held=", ".join(f"{word:08X}h" for word in held) or "0",
            )
        cob = int.from_bytes(self._read(station, pdo.communication, 1), "little")
        kind = fitted(self._read(station, pdo.communication, 2), 1)
        wanted = pdo.cob_id | cob & _PDO_FLAGS
        synchronous = bytes([SYNCHRONOUS])
        if (cob, kind) == (wanted, synchronous):
            return
        closed = (cob | INVALID).to_bytes(4, "little")
        opens = self._tried(station, SdoWrite(pdo.communication, 1, closed))
        # Outputs of another type take effect on arrival; inputs would come at any time.
        needs_kind = kind != synchronous and pdo.direction == "tx"
        kept = self._tried(station, SdoWrite(pdo.communication, 2, synchronous))
        if opens:
            opens = self._tried(
                station, SdoWrite(pdo.communication, 1, wanted.to_bytes(4, "little"))
            )
        elif cob == wanted:
            opens = True
        if not opens or (needs_kind and not kept):
            raise NotAllowed(
                "canopen.fixed-pdo-without-sync",
                drive=text("canopen.node", node=station),
                parameter=f"{pdo.communication:04X}:{1 if not opens else 2:02d}",
                node=station,
                pdo_number=pdo.number + 1,
            )

    def _held(self, station: int, mapping: int) -> list[int]:
        count = self._read(station, mapping, 0)[0]
        return [
            int.from_bytes(self._read(station, mapping, n), "little")
            for n in range(1, min(count, 8) + 1)
        ]

    def _tried(self, station: int, write: SdoWrite) -> bool:
        """Write as `_change`; return whether the drive accepted it."""
        try:
            self._change(station, write)
        except Rejected:
            return False
        return True

    def _remember(self, pdo: PdoPlan, cob: bytes) -> None:
        """Record the undo list, which runs from its end: invalid, then the mapping, then valid."""
        station = pdo.station
        kind = fitted(self._read(station, pdo.communication, 2), 1)
        count = fitted(self._read(station, pdo.mapping, 0), 1)
        entries = [self._read(station, pdo.mapping, n) for n in range(1, min(count[0], 8) + 1)]
        before = [
            SdoWrite(pdo.communication, 1, cob),
            SdoWrite(pdo.mapping, 0, count),
            *[SdoWrite(pdo.mapping, n, e) for n, e in enumerate(entries, 1)][::-1],
            SdoWrite(pdo.mapping, 0, b"\0"),
            SdoWrite(pdo.communication, 2, kind),
            _closed(pdo, cob),
        ]
        self._undo += [(station, write) for write in before]

    def _put_back(self, undo: Sequence[tuple[int, SdoWrite]]) -> None:
        failures: list[Text] = []
        silent: set[int] = set()
        for each in reversed(undo):
            station, write = each
            if station not in silent:  # requests to a drive that does not answer only take time
                self._put_back_one(station, write, failures, silent)
            self._undo = [other for other in self._undo if other is not each]
        if failures:
            raise NotAllowed("canopen.settings-drives-not-put", failures=joined(failures))

    def _put_back_one(
        self, station: int, write: SdoWrite, failures: list[Text], silent: set[int]
    ) -> None:
        """Write one setting; add a failure, and a station that does not answer."""
        try:
            self._write(station, write.index, write.subindex, write.data)
        except LinkLost:
            raise
        except LinkTimeout as error:
            silent.add(station)
            failures.append(text("canopen.not-put-silent", node=station, cause=error.text))
        except DriveError as error:
            key = f"{write.index:04X}:{write.subindex:02X}"
            failures.append(text("canopen.not-put", node=station, key=key, cause=error.text))


def _closed(pdo: PdoPlan, cob: bytes) -> SdoWrite:
    """Return the write that makes a PDO invalid and keeps its identifier."""
    invalid = int.from_bytes(cob, "little") | INVALID
    return SdoWrite(pdo.communication, 1, invalid.to_bytes(4, "little"))
