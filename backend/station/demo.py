"""The demo bench: virtual drives on real wires, in separate processes."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from pydantic import ValidationError

from backend.axes.scales.gear_calculator import Mechanics
from drivers.computer.processes import SESSIONS
from drivers.errors import DriveError, LinkLost, NotAllowed
from drivers.ethercat.link import EthercatLink
from drivers.link import Found, Link
from drivers.texts.message import Text, Unsuitable, text
from drivers.texts.validation import reason_of
from drivers.urls import link_for
from drivers.virtual.bench import AxisSpec, BenchSpec, bench_file, load_bench, write_bench
from drivers.virtual.defects import DEFECT_WORDS
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, NamespaceUnavailable

if TYPE_CHECKING:
    from backend.station.bench import Bench

#: A fault that needs no motion and that a reset clears.
TRAINING_FAULT = "under_voltage"
#: Largest number of scans of a bus until all of its drives have answered.
_TRIES = 10
#: Pause between scans [s]: on a busy computer the segment answers late after its start.
_PAUSE_S = 1.0


class DemoBench:
    """Starts the wires of a bench file and holds their real addresses.

    ``bench``: the file, the name of a bench of the product, or None for the standard bench.
    ``segment_options``: options of the EtherCAT segments (see drivers.virtual.wires.ethercat). With
    ``steady`` a cycle that is late because the computer is busy does not count as late in the
    drives. ``defects``: defects in addition to those of the file, each as ``AXIS=DEFECT``.
    Used as a context manager; its exit ends all virtual drives.
    """

    def __init__(
        self,
        bench: Path | None,
        folder: Path,
        nvm: Path | None = None,
        *,
        segment_options: Sequence[str] = (),
        steady: bool = False,
        defects: Sequence[str] = (),
    ) -> None:
        self._steady = steady
        self._segment_options = tuple(segment_options)
        self._file = bench_file(bench)
        self._folder = folder
        if defects:
            folder.mkdir(parents=True, exist_ok=True)
            write_bench(self._file, defects, folder / "bench.json")
            self._file = folder / "bench.json"
        self._nvm = nvm
        self._host: subprocess.Popen[str] | None = None
        self._asking = threading.Lock()  # keeps each answer with its command
        self.spec: BenchSpec = load_bench(self._file)
        #: Factories of the links, by bus URL of the bench.
        self.wires: dict[str, Callable[[], Link]] = {}
        #: Addresses of the same wires for other programs, by bus URL.
        self.addresses: dict[str, str | Text] = {}
        self.segments: dict[str, VirtualSegment] = {}
        self._namespaces: list[Namespace] = []
        #: Messages for the user about wires that could not be started.
        self.problems: list[Text] = []

    @property
    def names(self) -> dict[tuple[str, int], str]:
        """Names of the drives in the bench file, by bus URL and station of each port."""
        return {port: axis.name for axis in self.spec.axis for port in axis.ports}

    @property
    def planted(self) -> tuple[tuple[str, Text], ...]:
        """Pairs of axis name and description, one for each defect of an axis."""
        return tuple(
            (axis.name, DEFECT_WORDS[defect]) for axis in self.spec.axis for defect in axis.defects
        )

    def start(self) -> None:
        """Start the virtual drives and wait until their wires exist.

        Raises:
            LinkLost: a wire could not be created; the message states the reason.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        arguments = ["--bench", str(self._file), "--folder", str(self._folder)]
        if self._nvm is not None:
            self._nvm.mkdir(parents=True, exist_ok=True)
            arguments += ["--nvm", str(self._nvm)]
        self._host = subprocess.Popen(
            [sys.executable, "-m", "drivers.virtual.host", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            # Ctrl+C in the terminal ends the server first, which then ends the drives.
            start_new_session=SESSIONS,
        )
        answer = self._read()
        if not answer.get("ready"):
            self.stop()
            raise LinkLost(
                "station.virtual-drives-not-start",
                get=_said(answer),
            )
        wires = answer["wires"]
        if isinstance(wires, dict):
            self.addresses.update(wires)
            self.wires.update({url: partial(link_for, real) for url, real in wires.items()})
        for number, url in enumerate(self.spec.urls("ethercat")):
            self._start_segment(url, number)

    def _start_segment(self, url: str, number: int) -> None:
        """Start a private network with the segment at one end of its cable.

        Where the system does not permit such networks, the segment is left out and reported in
        `problems`.
        """
        master, slave = f"ec{number}m", f"ec{number}s"
        try:
            namespace = Namespace.create([(master, slave)])
        except NamespaceUnavailable as error:
            self.problems.append(text("virtual.wire-left-out", url=url, cause=error.why))
            return
        self._namespaces.append(namespace)
        arguments = ["--bench", str(self._file), "--on", url, *self._segment_options]
        if self._steady:
            arguments.append("--steady")
        if self._nvm is not None:
            folder = self._nvm / f"ethercat{number}"
            folder.mkdir(parents=True, exist_ok=True)
            arguments += ["--nvm", str(folder)]
        self.segments[url] = VirtualSegment.start(slave, arguments, namespace)
        launcher = namespace.command(())
        # In lockstep the drives' time advances with the frames, so a late reply is awaited.
        patient = self._steady or "--lockstep" in self._segment_options
        self.addresses[url] = text("virtual.wire-in-namespace", interface=master, pid=namespace.pid)
        self.wires[url] = partial(
            EthercatLink, master, url=url, launcher=launcher, lockstep=1.0 if patient else 0.0
        )

    def command(self, **command: object) -> object:
        """Send a command to the virtual drives and return its result; see drivers.virtual.host.

        Raises:
            ValueError: the command is refused.
            LinkLost: the process has ended.
        """
        if self._host is None or self._host.stdin is None:
            raise LinkLost("station.virtual-drives-not-run")
        with self._asking:
            try:
                self._host.stdin.write(json.dumps(command) + "\n")
                self._host.stdin.flush()
            except OSError as error:
                raise LinkLost("station.virtual-drives-ended") from error
            answer = self._read()
        if not answer.get("ok"):
            raise Unsuitable(_said(answer))
        return answer.get("result")

    def cause_fault(self, url: str, station: int) -> None:
        """Cause an under-voltage fault in the virtual drive at a station, for training.

        Raises:
            NotAllowed: no drive of the bench is at this station.
            ValueError: the drive refuses.
            LinkLost: the virtual drives have ended.
        """
        segment = self.segments.get(url)
        for place, (axis, at) in enumerate(self.spec.on(url)):
            if at != station:
                continue
            if segment is not None:
                segment.command("inject", slave=place, what=TRAINING_FAULT)
            else:
                self.command(do="inject", axis=axis.name, what=TRAINING_FAULT)
            return
        raise NotAllowed("station.no-virtual-drive", url=url, station=station)

    def stop(self) -> None:
        """End the virtual drives. Calling again does nothing."""
        for segment in self.segments.values():
            segment.close()
        for namespace in self._namespaces:
            namespace.close()
        self.segments, self._namespaces = {}, []
        host, self._host = self._host, None
        if host is None:
            return
        for stream in (host.stdin, host.stdout):
            if stream is not None:
                stream.close()
        try:
            host.wait(timeout=5)
        except subprocess.TimeoutExpired:
            host.kill()
            host.wait()

    def _read(self) -> dict[str, object]:
        if self._host is None or self._host.stdout is None:
            return {}
        line = self._host.stdout.readline()
        message = json.loads(line) if line else {}
        return message if isinstance(message, dict) else {}

    def __enter__(self) -> DemoBench:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()


def mechanics_of(axis: AxisSpec) -> Mechanics | None:
    """Mechanics of an axis of a bench file; None where the file does not state them.

    Raises:
        NotAllowed: the mechanics are not valid; the message names the field.
    """
    if not axis.moves:
        return None
    try:
        return Mechanics.model_validate(axis.moves)
    except ValidationError as error:
        first = error.errors()[0]
        raise NotAllowed(
            "virtual.bench-file-see-docs",
            value=axis.name,
            path=axis.name,
            place=".".join(["moves", *(str(part) for part in first["loc"])]),
            first=reason_of(first),
        ) from error


async def connect_axes(bench: Bench, spec: BenchSpec) -> list[str]:
    """Connect the axes that a bench file marks as connected, in the order of the file.

    A bench that already has drives, from an earlier run, is left unchanged. Nothing is enabled and
    nothing is written to a drive. An axis that cannot be connected is logged.

    Returns:
        The ids of the axes that were connected.
    """
    if bench.connected_drives:
        return []
    made: list[str] = []
    found: dict[tuple[str, int], Found] = {}
    for url in spec.urls():
        stations = [at for axis, at in spec.on(url) if axis.connected and axis.on == url]
        if stations and url in bench.buses.wires:
            found |= {(url, each.station): each for each in await _search(bench, url, stations)}
    for axis in spec.axis:
        if not axis.connected or axis.on not in bench.buses.wires:
            continue
        try:
            made.append(await _connect(bench, axis, found.get((axis.on, axis.station))))
        except DriveError as error:
            line = text("journal.not-connected", drive=axis.name, cause=error.text)
            bench.journal.add(line, level="error")
    return made


async def _search(bench: Bench, url: str, stations: list[int]) -> list[Found]:
    """Drives that answer; scanned up to `_TRIES` times, as a busy computer may miss a drive."""
    seen: list[Found] = []
    for attempt in range(_TRIES):
        if attempt:
            await asyncio.sleep(_PAUSE_S)
        try:
            seen = await bench.buses.scan(url, stations, lambda _fraction, _step: None)
        except DriveError as error:
            line = text("journal.bus-trouble", url=url, cause=error.text)
            bench.journal.add(line, level="warning")
        if {each.station for each in seen} >= set(stations):
            break
    return seen


async def _connect(bench: Bench, axis: AxisSpec, found: Found | None) -> str:
    mechanics = mechanics_of(axis)
    if found is None:
        raise NotAllowed(
            "command.nothing-answers-station-check-power", station=axis.station, url=axis.on
        )
    connected = await bench.connect(axis.on, axis.station, axis.drive, axis.name, found=found)
    drive = connected.drive.id
    if mechanics is not None:
        record = bench.axis_records.get(drive)
        bench.axis_records.put(drive, record.model_copy(update={"mechanics": mechanics}))
    return drive


def _said(answer: Mapping[str, object]) -> Text:
    """Return why the process of the virtual drives refuses, or that it ended without a message."""
    said = answer.get("error")
    return Text.from_wire(said) if isinstance(said, Mapping) else text("virtual.process-ended")
