"""Process data of one bus: selection of the mapped signals, and their delivery in units."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing
from backend.axes.drive.ports import Port, address_of
from drivers.errors import Busy, DriveError, NotAllowed
from drivers.link import (
    Cyclic,
    CyclicSignal,
    Link,
    OwnsPowerState,
    ScopeBlock,
    Unsubscribe,
)
from drivers.texts.message import Text, text

#: Signals to map, in order of importance; those that do not fit are left out.
INPUT_ROLES = (
    "status_word", "position_actual", "velocity_actual", "torque_actual", "load_position",
    "mode_display", "following_error", "error_code", "digital_inputs", "velocity_demand",
    "position_demand",
)  # fmt: skip
OUTPUT_ROLES = (
    "control_word", "mode", "position_target", "velocity_target", "torque_target",
    "position_offset", "velocity_offset", "torque_offset",
)  # fmt: skip
#: Objects that CiA 402-2 leaves to the maker: a drive may lack what its profile names.
_OPTIONAL_ROLES = ("load_position",)
#: Outputs of a drive that is commanded in Profile velocity mode.
_SPEED_ROLES = ("control_word", "velocity_target")


@dataclass(frozen=True, slots=True)
class CyclicState:
    """State of an exchange as the page shows it.

    ``left_over``: signals that are not mapped, each with the reason.
    """

    cycle_s: float
    dc: bool | None
    channels: tuple[str, ...]
    left_over: tuple[tuple[str, Text], ...]


class CyclicSession:
    """The running exchange of one bus, between `start` and `stop`.

    The drives with the identifiers ``by_speed`` have no cyclic mode and receive speeds in Profile
    velocity; other drives without a cyclic mode keep receiving single commands.
    """

    def __init__(self, link: Link, drives: Sequence[Drive], by_speed: Collection[str] = ()) -> None:
        if link.cyclic is None:
            raise NotAllowed("axis.no-cyclic-process-data", url=link.url)
        self.link = link
        self.cyclic: Cyclic = link.cyclic
        self.drives = tuple(drives)
        self.by_speed = frozenset(by_speed)
        self.state: CyclicState | None = None

    async def start(self, cycle_s: float) -> CyclicState:
        """Map the signals of all drives and start the exchange.

        Raises:
            NotAllowed: a drive refuses; the error contains the reason as text.
            Busy: the exchange runs already.
        """
        if self.state is not None:
            raise Busy("axis.cyclic-exchange-runs-already", url=self.link.url)
        inputs, outputs = [], []
        for drive in self.drives:
            port = self._port(drive)
            self.link.attach(port.station, drive.profile)
            by_speed = drive.id in self.by_speed
            if self.cyclic.speeds is not None:
                self.cyclic.speeds.take_speeds(port.station, by_speed)
            roles = _SPEED_ROLES if by_speed else OUTPUT_ROLES
            found = [role for role in INPUT_ROLES if await _has(drive, role)]
            inputs += _signals(drive, port, found, ("tx", "rxtx"))
            outputs += _signals(drive, port, roles, ("rx", "rxtx"), needed=roles[:1])
        outputs = _fitting_outputs(self.drives, outputs)
        mapped = await self.cyclic.configure(inputs, outputs, cycle_s)
        try:
            await self.cyclic.start()
        except BaseException:
            # An exchange that starts too late, or after the caller was cancelled, would own the
            # drives unnoticed.
            with contextlib.suppress(DriveError):
                await asyncio.shield(self.cyclic.stop())
            raise
        left = {s.channel for s in [*inputs, *outputs]} - {s.channel for s in mapped}
        reasons = {s.channel: why for s, why in self.cyclic.left_over}
        self.state = CyclicState(
            cycle_s=cycle_s,
            dc=self.cyclic.dc,
            channels=tuple(signal.channel for signal in mapped),
            left_over=tuple((c, reasons.get(c, text("axis.signal-not-fit"))) for c in sorted(left)),
        )
        return self.state

    async def stop(self) -> None:
        """Brake all moving axes and end the exchange."""
        self.state = None
        await self.cyclic.stop()

    @property
    def running(self) -> bool:
        """Whether process data are exchanged."""
        return self.state is not None and self.cyclic.running

    @property
    def trouble(self) -> Text | None:
        """Why the exchange does not run while it is set up again automatically; None otherwise."""
        return self.cyclic.trouble

    def power(self) -> OwnsPowerState | None:
        """The loop, where it owns the control words; None otherwise."""
        return self.cyclic.power

    def unwatched(self, drive: Drive) -> bool:
        """Whether the drive has no watchdog that ends a motion when this computer stops sending."""
        port = self._port(drive)
        if port.spec is None or not port.spec.watchdog.present:
            return True
        speeds = self.cyclic.speeds
        return speeds is not None and port.station in speeds.unguarded

    @property
    def synchronous(self) -> bool:
        """Whether setpoints take effect and samples are taken at a fixed instant of each cycle."""
        return self.state is not None and (bool(self.state.dc) or self.link.traits.synchronous)

    def _port(self, drive: Drive) -> Port:
        return next(port for port in drive.ports if port.link is self.link)

    def station(self, drive: Drive) -> int:
        """Station of a drive on this bus."""
        return self._port(drive).station

    def carries(self, drive: Drive, key: str) -> bool:
        """Whether this signal is part of the running process data."""
        return (
            self.running and self.state is not None and channel(drive, key) in self.state.channels
        )

    def newest(self, drive: Drive, keys: Sequence[str], within_s: float) -> dict[str, int | float]:
        """Raw values of the last cycle, for the keys that are mapped as inputs.

        ``within_s``: greatest age of a value [s].
        """
        if not self.running:
            return {}
        reported = {drive.key(role) for role in INPUT_ROLES}
        names = {channel(drive, key): key for key in keys if key in reported}
        return {names[name]: raw for name, raw in self.cyclic.newest(list(names), within_s).items()}

    def subscribe(
        self, drive: Drive, keys: Sequence[str], deliver: Callable[[ScopeBlock], None]
    ) -> Unsubscribe:
        """Deliver blocks of exactly these keys, in the parameters' units."""
        names = tuple(channel(drive, key) for key in keys)
        parameters = [drive.parameter(key) for key in keys]
        scale = np.array([p.scale for p in parameters])
        offset = np.array([p.offset for p in parameters])

        known: tuple[str, ...] = ()
        columns: list[int] = []

        def take(block: ScopeBlock) -> None:
            nonlocal known, columns
            if block.channels != known:
                known = block.channels
                columns = [known.index(name) for name in names if name in known]
            if len(columns) != len(names):
                return
            samples = block.samples[:, columns]
            valid = block.valid
            absent: npt.NDArray[np.bool_] = np.asarray(np.isnan(samples).any(axis=1))
            if absent.any():  # this drive is lost; the others on its bus go on
                valid = ~absent if valid is None else valid & ~absent
            deliver(
                ScopeBlock(
                    sequence=block.sequence,
                    t0_s=block.t0_s,
                    dt_s=block.dt_s,
                    channels=tuple(keys),
                    samples=samples * scale + offset,
                    dropped=block.dropped,
                    valid=valid,
                )
            )

        return self.cyclic.blocks(take)


def channel(drive: Drive, key: str) -> str:
    """Name of a signal in the blocks of a bus."""
    return f"{drive.id}/{key}"


async def _has(drive: Drive, role: str) -> bool:
    """Whether a signal may be mapped; an optional object is first read from the drive."""
    key = drive.key(role)
    if role not in _OPTIONAL_ROLES or key is None:
        return True
    try:
        return key in await existing(drive, (key,))
    except DriveError:
        return False


def _signals(
    drive: Drive,
    port: Port,
    roles: Sequence[str],
    directions: Sequence[str],
    needed: Collection[str] = (),
) -> list[CyclicSignal]:
    """Signals of these roles; fixed process data may lack those outside ``needed``."""
    found = []
    for role in roles:
        parameter = drive.profile.by_role.get(role)
        if parameter is not None and parameter.pdo in directions:
            found.append(
                CyclicSignal(
                    port.station,
                    address_of(parameter),
                    channel(drive, parameter.key),
                    optional=role not in needed,
                )
            )
    return found


def _fitting_outputs(drives: Sequence[Drive], wanted: list[CyclicSignal]) -> list[CyclicSignal]:
    """Outputs without those that exceed a drive's limit; the bus maps all outputs or none."""
    room = {drive.id: drive.profile.pdo.max_entries if drive.profile.pdo else 8 for drive in drives}
    kept = []
    for signal in wanted:
        drive_id = signal.channel.split("/", 1)[0]
        if room[drive_id] > 0:
            room[drive_id] -= 1
            kept.append(signal)
    return kept
