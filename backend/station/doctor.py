"""Diagnosis of a station that does not reach Operational, and trials of bring-up settings.

A trial writes no parameter and enables nothing: the exchange of one station is started with a
profile that differs in one setting, and ended; then the earlier profile is used again. A setting
that a person keeps afterwards holds as long as the drive stays connected, and is not stored.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from drivers.cia402 import State
from drivers.doctor.diagnosis import Cause
from drivers.doctor.examined import Examination
from drivers.doctor.trials import Trial, trials
from drivers.errors import DriveError, NotAllowed
from drivers.link import Address, CyclicSignal, Link
from drivers.texts.message import text
from profiles.schema import DataType, Profile

if TYPE_CHECKING:
    from backend.station.bench import Bench
    from backend.station.drives.connected_drive import ConnectedDrive

_INPUTS: tuple[tuple[int, DataType], ...] = ((0x6041, "UINT16"), (0x6064, "INT32"))
_OUTPUTS: tuple[tuple[int, DataType], ...] = ((0x6040, "UINT16"),)
_CYCLE_S = {"ethercat": 0.001, "canopen": 0.01}
_ENABLED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)


@dataclass(frozen=True, slots=True)
class Examined:
    """Result of taking one station to Operational; ``refusal``: error of the start, if any."""

    station: int
    reached: bool
    refusal: DriveError | None
    causes: tuple[Cause, ...]


async def examined(link: Link, station: int, cycle_factor: int = 1) -> Examined:
    """Take one station to Operational and back, without enabling it.

    ``cycle_factor`` multiplies the cycle time of the exchange, which is 1 ms on EtherCAT and 10 ms
    on CANopen.

    Raises:
        NotAllowed: the bus has no diagnosis, or no cyclic exchange.
    """
    cyclic = link.cyclic
    if cyclic is None or link.doctor is None:
        raise NotAllowed("station.doctor-knows-not", value=link.url)
    inputs = [CyclicSignal(station, Address(i, 0, k), f"{i:04X}") for i, k in _INPUTS]
    outputs = [CyclicSignal(station, Address(i, 0, k), f"{i:04X}") for i, k in _OUTPUTS]
    refusal: DriveError | None = None
    started = False
    try:
        try:
            await cyclic.configure(inputs, outputs, _CYCLE_S[link.kind] * cycle_factor)
            await cyclic.start()
            started = True
        except DriveError as error:
            refusal = error
        found = await link.doctor.examination(station, refusal)
    finally:
        # A start that timed out or was cancelled may still complete later.
        with contextlib.nullcontext() if started else contextlib.suppress(DriveError):
            await cyclic.stop()
    return Examined(station, found.reached, refusal, found.causes)


async def tried(link: Link, station: int, profile: Profile, trial: Trial) -> Examined:
    """Examine a station with one setting changed; ``profile`` is attached again afterwards."""
    link.attach(station, trial.profile)
    try:
        return await examined(link, station, trial.cycle_factor)
    finally:
        link.attach(station, profile)


@dataclass(frozen=True, slots=True)
class Kept:
    """A trial setting kept for a connected drive; ``before``: its profile without the setting."""

    trial: Trial
    before: Profile


class Doctor:
    """Trials on the buses of one bench, by bus URL and station."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._offered: dict[tuple[str, int], tuple[Profile, tuple[Trial, ...]]] = {}
        self._reached: dict[tuple[str, int], tuple[Profile, Trial]] = {}
        self._kept: dict[tuple[str, int], Kept] = {}

    async def examination(self, url: str, station: int) -> tuple[Examination, Sequence[Trial]]:
        """Diagnosis of a station, and the trials possible on it; changes no state of a drive.

        Raises:
            NotAllowed: the bus is not open or has no diagnosis.
        """
        link = self._link(url)
        if link.doctor is None:
            raise NotAllowed("station.doctor-knows-not", value=url)
        found = await link.doctor.examination(station)
        connected = self._drive_at(url, station)
        if connected is None or self.kept(url, station) is not None:
            return found, ()  # one setting at a time: the kept one must be undone first
        profile = connected.drive.profile
        offered = trials(found.causes, profile)
        self._offered[url, station] = profile, offered
        return found, offered

    def kept(self, url: str, station: int) -> Kept | None:
        """The setting that is kept at a station; None where the drive has its original profile."""
        kept, connected = self._kept.get((url, station)), self._drive_at(url, station)
        if kept is None or connected is None or connected.drive.profile is not kept.trial.profile:
            return None
        return kept

    async def run(self, url: str, station: int, setting: str, after: str) -> Examined:
        """Try a setting that the last examination offered, and undo it afterwards.

        Raises:
            NotAllowed: it was not offered, no drive is connected there, or a drive is enabled.
            DriveError: another drive on the bus does not report whether it is enabled.
            Busy: a drive on the bus moves, or the exchange runs or is being changed.
        """
        link, place = self._link(url), (url, station)
        connected = self._require_drive(url, station)
        profile = connected.drive.profile
        known, offered = self._offered.get(place, (None, ()))
        trial = next((t for t in offered if (t.setting, t.after) == (setting, after)), None)
        if trial is None or known is not profile:
            raise NotAllowed("station.trial-not-offered", station=station, setting=setting)
        self._reached.pop(place, None)
        with self._bench.exchanges.reserved(url):
            await self._require_disabled(url, connected)
            result = await tried(link, station, profile, trial)
        if result.reached:
            self._reached[place] = profile, trial
        return result

    def keep(self, url: str, station: int, setting: str, after: str) -> Kept:
        """Keep a setting with which a trial has just taken this station to Operational.

        Raises:
            NotAllowed: it was not tried, did not reach Operational, or is the cycle time, which is
                chosen where the exchange is started.
            Busy: the exchange runs.
        """
        connected = self._require_drive(url, station)
        profile, trial = self._reached.get((url, station), (None, None))
        if (
            trial is None
            or (trial.setting, trial.after) != (setting, after)
            or connected.drive.profile is not profile
        ):
            raise NotAllowed("station.trial-not-verified", station=station, setting=setting)
        if not trial.of_profile:
            raise NotAllowed("station.trial-of-cycle", station=station)
        with self._bench.exchanges.reserved(url):
            self._use(url, station, connected, trial.profile)
            self._kept[url, station] = kept = Kept(trial, profile)
        facts = {"setting": trial.setting, "before": trial.before, "after": trial.after}
        line = text("journal.trial-kept", drive=connected.drive.name, **facts)
        self._bench.tell(line, connected, "warning")
        return kept

    def undo(self, url: str, station: int) -> None:
        """Use the profile again with which the drive was connected.

        Raises:
            NotAllowed: nothing is kept there.
            Busy: the exchange runs.
        """
        kept, connected = self.kept(url, station), self._drive_at(url, station)
        if kept is None or connected is None:
            raise NotAllowed("station.nothing-kept", station=station)
        with self._bench.exchanges.reserved(url):
            self._use(url, station, connected, kept.before)
            del self._kept[url, station]
        line = text("journal.trial-undone", drive=connected.drive.name, setting=kept.trial.setting)
        self._bench.tell(line, connected)

    def _use(self, url: str, station: int, connected: ConnectedDrive, profile: Profile) -> None:
        self._offered.pop((url, station), None)
        self._reached.pop((url, station), None)
        self._link(url).attach(station, profile)
        connected.drive.profile = profile

    async def _require_disabled(self, url: str, tried: ConnectedDrive) -> None:
        """Check that no motor on the bus has power, as the start of an exchange resets all drives.

        Raises:
            NotAllowed: one has.
            DriveError: a drive other than ``tried`` does not answer, so its state is not known.
        """
        for connected in self._on(url):
            try:
                state = await connected.axis.state()
            except DriveError:
                if connected is not tried:
                    raise
                continue
            if state in _ENABLED:
                raise NotAllowed("station.enabled-drive", drive=connected.drive.name)

    def _link(self, url: str) -> Link:
        link = self._bench.buses.opened.get(url)
        if link is None:
            raise NotAllowed("station.not-open", value=url)
        return link

    def _on(self, url: str) -> list[ConnectedDrive]:
        buses = self._bench.buses
        return [m for m in self._bench.connected_drives.values() if url in buses.urls_of(m.drive)]

    def _drive_at(self, url: str, station: int) -> ConnectedDrive | None:
        buses = self._bench.buses
        return next(
            (
                m
                for m in self._on(url)
                for port in m.drive.ports
                if port.station == station and buses.url_of(port) == url
            ),
            None,
        )

    def _require_drive(self, url: str, station: int) -> ConnectedDrive:
        connected = self._drive_at(url, station)
        if connected is None:
            raise NotAllowed("station.no-drive-to-try", station=station)
        return connected
