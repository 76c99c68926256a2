"""Identity of a drive, marks of values not saved or not in effect, and typed reads."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence

from backend.axes.drive.batches import asked_in_batches
from backend.axes.drive.exclusive import ExclusiveAccess
from backend.axes.drive.motion_keys import command_keys, motion_keys
from backend.axes.drive.notes.change_marks import ChangeMarks
from backend.axes.drive.notes.listeners import DriveListeners
from backend.axes.drive.notes.pending_restore import PendingRestores
from backend.axes.drive.ports import Port, address_of, port_for, unreachable_why
from backend.axes.drive.readings import Reading
from backend.axes.drive.value_check import named
from backend.axes.motion.authority import MotionAuthority
from drivers import cia402
from drivers.errors import (
    DriveError,
    NotAllowed,
    NotInUse,
    OutOfRange,
)
from drivers.link import Found, LinkQuality
from drivers.objects.codec import decode
from drivers.texts.message import Text, text
from profiles.schema import Parameter, Profile


class ReadableDrive:
    """One drive: its identity, its change marks and typed reads.

    ``readings`` holds the last answer for every parameter that was read.
    """

    def __init__(
        self,
        drive_id: str,
        name: str,
        profile: Profile,
        ports: Sequence[Port],
        authority: MotionAuthority | None = None,
    ) -> None:
        self.id = drive_id
        #: Motion authority: shared within a server; the drive's own outside a server.
        self.authority = MotionAuthority() if authority is None else authority
        self.name = name
        self.exclusive = ExclusiveAccess(name)
        self.pending_restores = PendingRestores()
        self.notes = ""
        self.profile = profile
        self.ports = tuple(ports)
        self.found: Found | None = None
        self.identity_warning: Text | None = None
        self.readings: dict[str, Reading] = {}
        self._changes = ChangeMarks()
        self.listeners = DriveListeners()
        self._command_keys = command_keys(profile)
        self._motion_keys = motion_keys(profile)
        self._own_status = profile.quirk("own_status_word") is not None

    # --- what it is ------------------------------------------------------------------

    def parameter(self, key: str) -> Parameter:
        """The parameter of this key or maker's number.

        Raises:
            NotAllowed: the profile has none.
        """
        parameter = self.profile.parameter(key)
        if parameter is None:
            raise NotAllowed(
                "drive.no-parameter",
                drive=self.name,
                parameter=key,
                profile_title=self.profile.title,
            )
        return parameter

    def port_for(self, parameter: Parameter) -> Port:
        """The first port that can carry the parameter.

        Raises:
            NotAllowed: none can; the message states which link would.
        """
        return port_for(self.name, self.profile.drive, self.ports, parameter)

    def unreachable_why(self, parameter: Parameter) -> Text | None:
        """Why no port carries the parameter; None where one does."""
        return unreachable_why(self.ports, parameter)

    def quality(self) -> LinkQuality:
        """Counters of the first port."""
        port = self.ports[0]
        return port.link.quality(port.station)

    def key(self, role: str) -> str | None:
        """Key of the parameter with this role, where a connected port carries it."""
        parameter = self.profile.by_role.get(role)
        if parameter is None or not any(port.carries(parameter) for port in self.ports):
            return None
        return parameter.key

    @property
    def modes_key(self) -> str | None:
        """Key of 6502h where the profile does not know the modes; None otherwise.

        Only a profile for many drives does not know them. Elsewhere 6502h is not used, as manuals
        print it with wrong bits (002:14076).
        """
        return self.key("supported_modes") if self.profile.partial else None

    @property
    def modes(self) -> tuple[int, ...]:
        """Modes of operation of the profile, without those that the drive reports as absent."""
        modes = self.profile.supported_modes
        reading = self.readings.get(self.modes_key or "")
        reported = reading.raw if reading is not None else None
        if not isinstance(reported, int):
            return modes
        lacks = {mode for mode, bit in cia402.SUPPORTED_MODE_BIT.items() if not reported >> bit & 1}
        return tuple(mode for mode in modes if mode not in lacks) or modes

    def require(self, role: str) -> str:
        """Like `key`, for a role that is necessary.

        Raises:
            NotAllowed: the drive has no parameter with this role that a connected port carries.
        """
        key = self.key(role)
        if key is None:
            raise NotAllowed(
                "drive.no",
                drive=self.name,
                profile_title=self.profile.title,
                replace=role.replace("_", " "),
            )
        return key

    def decode_state(self, status_word: int) -> cia402.State:
        """CiA 402 state, with the family's own interpretation of the status word."""
        return cia402.decode_state(status_word, echoes_control=self._own_status)

    def fault_bit(self, key: str) -> int | None:
        """Bit of the family's status word that reports a fault; None for any other object."""
        if key != self.key("status_word"):
            return None
        return cia402.fault_bit(echoes_control=self._own_status)

    # --- change marks ----------------------------------------------------------------

    def commands_motion(self, key: str) -> bool:
        """Whether writing this parameter commands motion or a procedure immediately."""
        return key in self._command_keys

    def matters_to_motion(self, key: str) -> bool:
        """Whether a motion under way relies on this parameter staying as it is."""
        return key in self._motion_keys

    @property
    def unsaved(self) -> frozenset[str]:
        """Keys whose value in the drive is not yet in its memory."""
        return self._changes.unsaved(self.readings)

    @property
    def pending(self) -> dict[str, str]:
        """Keys of parameters that are not in effect yet, each with the action it waits for."""
        return dict(self._changes.pending)

    def mark_saved(self) -> None:
        """Clear the marks of unsaved changes, as the drive stored its parameters."""
        self._changes.stored.clear()
        self._announce_all()

    def mark_applied(self, *what: str) -> None:
        """Clear the pending marks that wait for one of ``what``.

        One of: write_settings, reenable, power_cycle.
        """
        self._changes.applied(*what)
        self._announce_all()

    def forget(self) -> None:
        """Discard all readings and change marks, as the drive restarted."""
        self._changes.forget()
        self.readings.clear()

    def _announce_all(self) -> None:
        self.listeners.read(list(self.readings.values()))

    # --- reading ---------------------------------------------------------------------

    async def read(self, key: str) -> Reading:
        """Read one parameter from the drive.

        Raises:
            DriveError: the parameter cannot be read; the error names drive and parameter.
        """
        parameter = self.parameter(key)
        if parameter.access == "wo":
            raise NotAllowed(
                "drive.written", drive=self.name, parameter=parameter.key, key=parameter.name
            )
        port = self.port_for(parameter)
        try:
            async with self.exclusive.asking():
                data = await port.link.read(port.station, address_of(parameter))
            reading = self._reading(parameter, data)
        except DriveError as error:
            raise named(self.name, self.profile.drive, error, parameter) from error
        self._store([reading])
        return reading

    async def raw(self, key: str) -> int:
        """Integer raw value of one parameter, read now."""
        value = (await self.read(key)).raw
        if isinstance(value, str) or value is None:
            raise OutOfRange("drive.text", drive=self.name, parameter=key)
        return int(value)

    async def read_many(
        self,
        keys: Iterable[str],
        progress: Callable[[float, Text], None] | None = None,
    ) -> dict[str, Reading]:
        """Read several parameters; one that fails is returned with ``problem`` set.

        After several batches in a row without an answer, the rest is not requested. Parameters that
        a link left out because the drive was slow are read once more at the end.

        Raises:
            LinkLost: the bus is gone; readings made before stay.
        """
        parameters = [self.parameter(key) for key in keys]
        result: dict[str, Reading] = {}
        groups: dict[int, list[Parameter]] = {}
        for parameter in parameters:
            position = next(
                (i for i, port in enumerate(self.ports) if port.carries(parameter)), None
            )
            if position is None or parameter.access == "wo":
                why = self.unreachable_why(parameter) or text("drive.write-only")
                result[parameter.key] = Reading(parameter.key, None, None, None, why)
            else:
                groups.setdefault(position, []).append(parameter)
        done = len(result)
        for position, group in groups.items():
            batches = asked_in_batches(self.ports[position], group, self.exclusive)
            async for chunk, answers in batches:
                readings = self._taken(chunk, answers)
                result.update({reading.key: reading for reading in readings})
                done += len(readings)
                if progress:
                    share = min(1.0, done / len(parameters))
                    progress(
                        share,
                        text(
                            "drive.parameters", result_count=len(result), parameters=len(parameters)
                        ),
                    )
        return result

    def _taken(
        self, chunk: Sequence[Parameter], answers: Sequence[bytes | DriveError]
    ) -> list[Reading]:
        readings: list[Reading] = []
        for parameter, answer in zip(chunk, answers, strict=True):
            if isinstance(answer, DriveError):
                readings.append(self._failed(parameter, answer))
                continue
            try:
                readings.append(self._reading(parameter, answer))
            except DriveError as error:
                readings.append(self._failed(parameter, error))
        self._store(readings)
        return readings

    def take(self, raws: Mapping[str, int | float]) -> dict[str, Reading]:
        """Store raw values that arrived without a request, such as process data."""
        now = time.time()
        readings = {
            key: Reading(key, raw, self.parameter(key).to_value(raw), now)
            for key, raw in raws.items()
        }
        self._store(list(readings.values()))
        return readings

    def _failed(self, parameter: Parameter, error: DriveError) -> Reading:
        unused = isinstance(error, NotInUse)
        return Reading(parameter.key, None, None, time.time(), error.text, unused)

    def _reading(self, parameter: Parameter, data: bytes) -> Reading:
        raw = decode(parameter.type, data)
        return Reading(parameter.key, raw, parameter.to_value(raw), time.time())

    def _store(self, readings: list[Reading]) -> None:
        for reading in readings:
            self.readings[reading.key] = reading
        self.pending_restores.seen(readings)
        self.listeners.read(readings)
