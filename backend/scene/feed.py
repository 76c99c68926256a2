"""Feed of the 3D scene with live positions, while a page shows it."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from backend.axes.scales.gear_calculator import Mechanics
from backend.axes.scales.units import AxisUnits
from backend.axes.scope.hub import Subscription
from backend.scene.geometry import Track, Travel, track_of, travel_of
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.link import ScopeBlock

if TYPE_CHECKING:
    from backend.scene.view import AxisLook, Look, SceneView

#: Period of the frames [s]; viser needs about 2 % of a core for them and 1 % for each page.
PERIOD_S = 1 / 30
#: Period of polled drives [s], the same as that of the frames.
POLL_S = 1 / 30
#: Periods for updating labels and limits [s].
_LABELS_S = 0.25
_LIMITS_S = 2.0


@dataclass(slots=True)
class _Axis:
    """Data of one axis in the feed."""

    connected: ConnectedDrive
    units: AxisUnits
    mechanics: Mechanics | None
    travel: Travel
    track: Track
    streams: list[Subscription]
    position_rev: float | None = None

    def take(self, block: ScopeBlock) -> None:
        """Take the newest position of a block; never blocks."""
        if len(block.samples) and np.isfinite(value := block.samples[-1, 0]):
            key = self.connected.drive.require("position_actual")
            raw = self.connected.drive.parameter(key).to_raw(float(value))
            self.position_rev = self.units.position(raw)


class SceneFeed:
    """One viser server for all viewers, started by the first and kept until `close`.

    ``mechanics_of`` returns the mechanics of an axis.
    """

    def __init__(self, bench: Bench, mechanics_of: Callable[[str], Mechanics | None]) -> None:
        self._bench = bench
        self._mechanics_of = mechanics_of
        self._view: SceneView | None = None
        self._starting = asyncio.Lock()
        self._viewers = 0
        self._task: asyncio.Task[None] | None = None

    async def join(self) -> int:
        """Add a viewer; return the loopback port of the scene's server.

        Raises:
            OSError: the server cannot be started.
        """
        async with self._starting:
            if self._view is None:
                self._view = await asyncio.to_thread(_make_view)
        self._viewers += 1
        if self._task is None or self._task.done():
            self._task = asyncio.create_task(self._run(self._view), name="scene")
        return self._view.port

    async def leave(self) -> None:
        """Remove a viewer; without viewers the feed ends and polls nothing."""
        self._viewers -= 1
        if self._viewers == 0:
            await self._end()

    async def close(self) -> None:
        """End the server of the scene."""
        await self._end()
        if self._view is not None:
            await asyncio.to_thread(self._view.close)
            self._view = None

    async def _end(self) -> None:
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])

    # --- while there are viewers --------------------------------------------------------

    async def _run(self, view: SceneView) -> None:
        axes: dict[str, _Axis] = {}
        try:
            while True:
                axes = await self._axes()
                arrangement = self._arrangement()
                await asyncio.to_thread(view.arrange, _looks(axes))
                await self._follow(view, axes, arrangement)
                await self._release(axes)
        finally:
            await self._release(axes)

    async def _follow(self, view: SceneView, axes: dict[str, _Axis], arrangement: object) -> None:
        """Update the scene until the axis list or limits have changed."""
        loop = asyncio.get_running_loop()
        labels_at = limits_at = loop.time()
        while True:
            await asyncio.sleep(PERIOD_S)
            now = loop.time()
            if now >= labels_at:
                labels_at = now + _LABELS_S
                if self._arrangement() != arrangement:
                    return
                for drive, axis in axes.items():
                    view.show(drive, *_shown(axis))
                if _grow(axes):
                    await asyncio.to_thread(view.arrange, _looks(axes))
            if now >= limits_at:
                limits_at = now + _LIMITS_S
                if any([await self._limits_changed(axis) for axis in axes.values()]):
                    return
            view.move({d: a.position_rev for d, a in axes.items() if a.position_rev is not None})

    def _arrangement(self) -> object:
        """Value that changes when the scene must be built again."""
        return {
            drive: (m.drive.name, id(m.axis.session), self._mechanics_of(drive))
            for drive, m in self._bench.connected_drives.items()
        }

    async def _axes(self) -> dict[str, _Axis]:
        axes: dict[str, _Axis] = {}
        for drive, connected in self._bench.connected_drives.items():
            mechanics = self._mechanics_of(drive)
            travel = travel_of(mechanics)
            try:
                units = await connected.axis.units()
                limits = await _software_limits(connected, units)
                key = connected.drive.require("position_actual")
                streams = [s for s, _ in self._bench.scope.subscribe(drive, [key], POLL_S)]
            except DriveError:
                # The drive does not answer now: it is shown without movement, and read again
                # when the limits are updated.
                units = AxisUnits(connected.drive.profile.units, None)
                limits, streams = None, []
            here = connected.monitor.snapshot.values.get("position") or 0.0
            axis = _Axis(
                connected, units, mechanics, travel, track_of(travel, here, limits), streams
            )
            for stream in streams:
                stream.sink = axis.take
            axes[drive] = axis
        return axes

    async def _release(self, axes: dict[str, _Axis]) -> None:
        for axis in axes.values():
            streams, axis.streams = axis.streams, []
            for stream in streams:
                await self._bench.scope.unsubscribe(stream)

    async def _limits_changed(self, axis: _Axis) -> bool:
        """Whether the limits have changed, or a drive without answer answers again."""
        try:
            units = await axis.connected.axis.units()
            limits = await _software_limits(axis.connected, units)
        except DriveError:
            return False
        if not axis.streams or units != axis.units:
            return True
        return track_of(axis.travel, 0.0, limits) != axis.track and (
            axis.track.limited or limits is not None
        )


def _make_view() -> SceneView:
    from backend.scene.view import SceneView  # importing viser takes more than a second

    return SceneView()


def _looks(axes: dict[str, _Axis]) -> dict[str, AxisLook]:
    from backend.scene.view import AxisLook

    return {
        drive: AxisLook(axis.connected.drive.name, axis.mechanics, axis.travel, axis.track)
        for drive, axis in axes.items()
    }


def _grow(axes: dict[str, _Axis]) -> bool:
    """Extend tracks that an axis without limits has left; return whether any was."""
    grown = False
    for axis in axes.values():
        if axis.position_rev is not None:
            track = axis.track.showing(axis.position_rev * axis.travel.per_rev)
            grown = grown or track != axis.track
            axis.track = track
    return grown


def look_of(state: State, *, fresh: bool) -> Look:
    """Appearance of a state in the scene.

    It shows a fault, whether the motor has torque (CiA 402-2, states of the FSA and supported
    functions), or that the state is not known.
    """
    if not fresh:
        return "unknown"
    match state:
        case State.OPERATION_ENABLED | State.QUICK_STOP_ACTIVE:
            return "on"
        case State.FAULT | State.FAULT_REACTION:
            return "fault"
        case State.UNKNOWN:
            return "unknown"
        case _:
            return "off"


def _shown(axis: _Axis) -> tuple[Look, str]:
    """The appearance of an axis, and its position as text; empty where that is not known."""
    snapshot = axis.connected.monitor.snapshot
    look = look_of(snapshot.state, fresh=snapshot.fresh)
    if not snapshot.fresh or axis.position_rev is None:
        return look, ""
    return look, f"{axis.position_rev * axis.travel.per_rev:.2f} {axis.travel.unit}"


async def _software_limits(
    connected: ConnectedDrive, units: AxisUnits
) -> tuple[float, float] | None:
    """Software limits of the drive in revolutions; None where it has none or they are off.

    A range of the whole 32 bits, or an empty one, is no limit (CiA 402-2 clause 7, 607Dh).
    """
    drive = connected.drive
    keys = [drive.key(role) for role in ("software_limit_min", "software_limit_max")]
    found: list[int] = []
    for key in keys:
        if key is None or drive.unreachable_why(drive.parameter(key)):
            return None
        with contextlib.suppress(DriveError):
            raw = (await drive.read(key)).raw
            if isinstance(raw, int):
                found.append(raw)
    if len(found) != 2 or found[0] >= found[1]:
        return None
    if found[0] <= -(2**31) + 1 and found[1] >= 2**31 - 1:
        return None
    return units.position(found[0]), units.position(found[1])
