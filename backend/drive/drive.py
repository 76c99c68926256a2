"""A drive: a profile, the ports it is reached through, and typed reads and writes.

Engineering values are ``raw * scale + offset`` of the parameter. A write is checked on the host
before a byte leaves (access, type, range, enum, state), then written, then read back: what
counts is the value that came back.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence

from backend.drive.batches import asked_in_batches
from backend.drive.change_marks import ChangeMarks
from backend.drive.exclusive import ExclusiveAccess
from backend.drive.listeners import DriveListeners
from backend.drive.motion_keys import command_keys, motion_keys
from backend.drive.pending_restore import PendingRestores
from backend.drive.ports import Port, address_of, carries
from backend.drive.readings import CommandRecord, Reading, Refusal, WriteRecord
from backend.drive.value_check import checked, named
from backend.motion.authority import MotionAuthority
from backend.motion.classes import held_still, motion_of
from backend.motion.doors import refused
from backend.motion.grant import Grant
from backend.motion.stopping import stops
from drivers import cia402
from drivers.codec import decode, encode
from drivers.errors import (
    DriveError,
    LinkTimeout,
    NotAllowed,
    NotInUse,
    OutOfRange,
)
from drivers.link import Found, LinkQuality
from drivers.texts.message import Text, text
from profiles.schema import Parameter, Profile, Raw

#: States in which the motor has power (CiA 402-2 table 28).
_POWERED = frozenset({
    cia402.State.OPERATION_ENABLED, cia402.State.QUICK_STOP_ACTIVE, cia402.State.FAULT_REACTION,
})  # fmt: skip


class Drive:
    """One drive of the bench.

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
        #: Who may move it: the bench's, or one of its own outside a server.
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
            NotAllowed: none can; the message says which link would.
        """
        for port in self.ports:
            if port.carries(parameter):
                return port
        raise NotAllowed(
            "drive.object-cannot-be-reached",
            drive=self.name,
            parameter=parameter.key,
            name=parameter.name,
            why=self.unreachable_why(parameter),
        )

    def unreachable_why(self, parameter: Parameter) -> Text | None:
        """None when some port carries the parameter, else why none does."""
        if any(port.carries(parameter) for port in self.ports):
            return None
        for port in self.ports:
            if carries(port.link.traits, parameter):
                return port.why_not(parameter)
        kinds = sorted({port.link.kind for port in self.ports})
        needed = "Modbus" if parameter.index is None else "CANopen"
        return text("drive.exists-only-over", needed=needed, kinds=", ".join(kinds) or "—")

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
        """Where the drive tells its modes, if its profile does not know them.

        Only a profile that stands for many drives does not: manuals print 6502h with wrong bits
        (002:14076).
        """
        return self.key("supported_modes") if self.profile.partial else None

    @property
    def modes(self) -> tuple[int, ...]:
        """Modes of operation: the profile's, without those that the drive itself says it lacks."""
        modes = self.profile.supported_modes
        reading = self.readings.get(self.modes_key or "")
        reported = reading.raw if reading is not None else None
        if not isinstance(reported, int):
            return modes
        lacks = {mode for mode, bit in cia402.SUPPORTED_MODE_BIT.items() if not reported >> bit & 1}
        return tuple(mode for mode in modes if mode not in lacks) or modes

    def require(self, role: str) -> str:
        """Like `key`, for a role that cannot be done without.

        Raises:
            NotAllowed: the family has no such parameter here.
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

    # --- change marks ----------------------------------------------------------------

    def commands_motion(self, key: str) -> bool:
        """Whether writing this parameter commands motion or a procedure at once."""
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
        """Keys that wait for something before they act, and for what."""
        return dict(self._changes.pending)

    def mark_saved(self) -> None:
        """The drive stored its parameters."""
        self._changes.stored.clear()
        self._announce_all()

    def mark_applied(self, *what: str) -> None:
        """What waited for one of ``what`` (write_settings, reenable, power_cycle) acts now."""
        self._changes.applied(*what)
        self._announce_all()

    def forget(self) -> None:
        """The drive restarted: nothing that was read before may be believed."""
        self._changes.forget()
        self.readings.clear()

    def _announce_all(self) -> None:
        self.listeners.read(list(self.readings.values()))

    # --- reading ---------------------------------------------------------------------

    async def read(self, key: str) -> Reading:
        """Read one parameter from the drive.

        Raises:
            DriveError: with drive and parameter named.
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
            raise named(self.name, error, parameter) from error
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
        """Read several parameters; one that fails comes back with ``error`` set.

        A drive that leaves several batches in a row without an answer is not asked for the rest.
        What a link left out because the drive was slow is asked once more at the end.

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
        """Keep values that came without being asked for, as with the process data."""
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

    # --- writing ---------------------------------------------------------------------

    def check(self, parameter: Parameter, raw: Raw) -> Raw:
        """A raw value as it will be written.

        Raises:
            NotAllowed, OutOfRange: as `backend.drive.value_check.checked`.
        """
        return checked(self.name, parameter, raw)

    async def write(self, key: str, value: Raw, *, raw: bool = True) -> Reading:
        """Write one parameter and return what was read back.

        ``value`` is a raw value, or one in the parameter's unit with ``raw=False``.

        Raises:
            NotGranted: it can put energy into the motor; the error says where that is done.
            NotAllowed, OutOfRange: nothing was sent.
            Rejected: the drive refused.
            LinkTimeout: the outcome is unknown, and reading back failed as well.
        """
        parameter, value = self.check_write(key, value, raw=raw)
        await self._require_harmless(parameter)
        return await self._written(parameter, value)

    def check_write(self, key: str, value: Raw, *, raw: bool = True) -> tuple[Parameter, Raw]:
        """What `write` refuses by the profile, before a byte leaves; the parameter and raw value.

        Raises:
            NotGranted, NotAllowed, OutOfRange: as `write`.
        """
        self._refuse_energising(key, value)
        return self._to_be_written(key, value, raw=raw)

    async def energise(self, key: str, raw: Raw, grant: Grant) -> Reading:
        """Like `write`, of a raw value to an object that can put energy into the motor.

        Raises:
            NotGranted: the grant is not for this object, or has ended.
        """
        parameter, raw = self._to_be_written(key, raw, raw=True)

        def permitted() -> None:
            restores = self.pending_restores.restores(parameter.key, raw)
            self.require_grant(grant, parameter.key, restores=restores)

        permitted()
        return await self._written(parameter, raw, permitted)

    async def put_back(self, key: str, raw: Raw) -> Reading:
        """Write a borrowed value back, of whatever class, by the work that had borrowed it.

        Raises:
            NotGranted: it energises, and the calling work holds no grant.
            DriveError: as `write`.
        """
        if motion_of(self.parameter(key)) != "energises":
            return await self.write(key, raw)
        return await self.energise(key, raw, self.authority.require_held(self.id, self.name, key))

    def require_grant(self, grant: Grant, key: str, *, restores: bool = False) -> None:
        """This grant permits to write this object now.

        Raises:
            NotGranted: it does not.
        """
        self.authority.require(grant, self.id, self.name, key, restores=restores)

    def _to_be_written(self, key: str, value: Raw, *, raw: bool) -> tuple[Parameter, Raw]:
        parameter = self.parameter(key)
        self.require_identity()
        if not raw and isinstance(value, (int, float)):
            try:
                value = parameter.to_raw(value)
            except OverflowError as error:
                raise named(
                    self.name,
                    OutOfRange("drive.no-number", given=value),
                    parameter,
                ) from error
        return parameter, self.check(parameter, value)

    def _refuse_energising(self, key: str, value: Raw) -> None:
        """Raises NotGranted where this object can put energy into the motor, whatever the value."""
        parameter = self.parameter(key)
        if motion_of(parameter) != "energises":
            return
        self.port_for(parameter)
        error = refused(self.name, self.profile, parameter)
        self.listeners.refused(Refusal(self.id, self.name, parameter.key, value, error.text))
        raise error

    async def _require_harmless(self, parameter: Parameter) -> None:
        """Writing it changes no motion that goes on, and nothing of an axis with power.

        Raises:
            NotAllowed: the axis is enabled or moved, and a motion relies on it.
        """
        if not held_still(parameter):
            return
        if self.authority.held(self.id) is not None:
            return  # changed for the length of a motion, by the motion itself
        if (mover := self.authority.mover_of(self.id)) is not None:
            by = f" by {mover.actor}" if mover.actor else ""
            raise NotAllowed(
                "drive.not-changed-during-motion",
                drive=self.name,
                parameter=parameter.key,
                key=parameter.name,
                purpose=mover.purpose,
                by=by,
            )
        await self._require_no_power(parameter)

    async def _written(
        self, parameter: Parameter, value: Raw, permitted: Callable[[], None] = lambda: None
    ) -> Reading:
        """``permitted`` raises where it may not be sent; asked once more at the last moment."""
        port = self.port_for(parameter)
        if parameter.settable == "stopped":
            await self._require_no_power(parameter)
        await self._before_change(parameter)
        known = self.readings.get(parameter.key)
        before = known.raw if known else None
        try:
            reading = await self._send_and_read(port, parameter, value, permitted)
        except BaseException as error:
            # A cancelled write may have reached the drive as well.
            problem = error.text if isinstance(error, DriveError) else text("drive.interrupted")
            self._tell_write(parameter, before, value, None, problem)
            raise
        self._tell_write(parameter, before, value, reading.raw)
        return reading

    async def _send_and_read(
        self, port: Port, parameter: Parameter, value: Raw, permitted: Callable[[], None]
    ) -> Reading:
        async with self.exclusive.asking():
            # STOP may have ended the grant while something was read, or the drive was left alone:
            # nothing is awaited between this and the link, which keeps the order of writes.
            permitted()
            return await self._sent_and_read(port, parameter, value)

    async def _sent_and_read(self, port: Port, parameter: Parameter, value: Raw) -> Reading:
        try:
            await self._send(port, parameter, value)
        except DriveError as error:
            raise named(self.name, error, parameter, value) from error
        if parameter.access == "wo":
            reading = Reading(parameter.key, value, parameter.to_value(value), time.time())
            self._store([reading])
            return reading
        if (
            parameter.effective not in ("now", "stopped")
            and parameter.key not in self._command_keys
        ):
            self._changes.pending[parameter.key] = parameter.effective
        return await self.read(parameter.key)

    def _tell_write(
        self,
        parameter: Parameter,
        before: Raw | None,
        wanted: Raw,
        after: Raw | None,
        problem: Text | None = None,
    ) -> None:
        self.pending_restores.sent(parameter.key, wanted, after)
        record = WriteRecord(
            self.id, self.name, parameter.key, parameter.name, before, wanted, after, problem
        )
        self.listeners.wrote(record)

    def require_identity(self) -> None:
        """The drive at this place is the one that was connected.

        Raises:
            NotAllowed: another one answers, and nobody has accepted it.
        """
        if self.identity_warning is not None:
            raise NotAllowed(
                "drive.nothing-written", drive=self.name, identity_warning=self.identity_warning
            )

    async def command(self, key: str, raw: int, grant: Grant) -> None:
        """Write a motion object without reading back (setpoints, control word).

        Raises:
            NotGranted: the grant is not for this object, or has ended.
            DriveError: as `write`.
        """
        parameter = self.parameter(key)
        restores = self.pending_restores.restores(parameter.key, raw)
        self.require_grant(grant, parameter.key, restores=restores)
        await self._sent(parameter, raw)

    async def relax(self, key: str, raw: int) -> None:
        """Write what only ends motion or takes power away, without reading back or a grant.

        Raises:
            ValueError: this value can move the axis, so it needs a grant.
            DriveError: as `write`.
        """
        parameter = self.parameter(key)
        if motion_of(parameter) == "energises" and not stops(self.profile, parameter, raw):
            raise ValueError(f"{parameter.key} = {raw} does not only stop")
        await self._sent(parameter, raw)

    async def stop_by(self, key: str, raw: int) -> None:
        """Write what STOP brakes with, without reading back or a grant.

        For `backend.stopping` alone (a test holds that): some ways to brake are values that could
        move an axis at another time, such as another mode with the setpoint zero, or halt.

        Raises:
            DriveError: as `write`.
        """
        await self._sent(self.parameter(key), raw)

    async def trigger(self, key: str, raw: int) -> None:
        """Write an object that runs something and moves nothing, without reading back.

        Raises:
            NotGranted: it can put energy into the motor.
            DriveError: as `write`.
        """
        self._refuse_energising(key, raw)
        parameter = self.parameter(key)
        await self._require_harmless(parameter)
        await self._sent(parameter, raw)

    async def _sent(self, parameter: Parameter, raw: int) -> None:
        port = self.port_for(parameter)
        self.exclusive.interrupt()
        self.pending_restores.commanded(parameter.key, raw)
        try:
            await port.link.write(port.station, address_of(parameter), encode(parameter.type, raw))
        except BaseException as error:
            # A cancelled command may have reached the drive as well.
            problem = error.text if isinstance(error, DriveError) else text("drive.interrupted")
            self._tell_command(parameter, raw, problem)
            if isinstance(error, DriveError):
                raise named(self.name, error, parameter, raw) from error
            raise
        self._tell_command(parameter, raw)

    def _tell_command(self, parameter: Parameter, raw: int, problem: Text | None = None) -> None:
        record = CommandRecord(self.id, self.name, parameter.key, parameter.name, raw, problem)
        self.listeners.commanded(record)

    async def _send(self, port: Port, parameter: Parameter, value: Raw) -> None:
        """Write; a time-out is unknown, so it is read back and never blindly repeated."""
        address = address_of(parameter)
        data = encode(parameter.type, value)
        try:
            await port.link.write(port.station, address, data)
        except LinkTimeout:
            if parameter.access == "wo":
                raise
            if await port.link.read(port.station, address) != data:
                raise

    async def _before_change(self, parameter: Parameter) -> None:
        """Remember what the drive's memory holds, for the "not saved" mark."""
        if parameter.key in self._command_keys or parameter.access != "rw":
            return
        if parameter.key in self._changes.stored:
            return
        known = self.readings.get(parameter.key)
        if known is None or known.raw is None:
            known = await self.read(parameter.key)
        if known.raw is not None:
            self._changes.stored[parameter.key] = known.raw

    async def _require_no_power(self, parameter: Parameter) -> None:
        """Raises NotAllowed where the motor has power."""
        status = self.key("status_word")
        if status is None:
            return
        try:
            state = self.decode_state(await self.raw(status))
        except DriveError as error:
            # What was wanted is what the person knows of.
            error.parameter = parameter.key
            raise
        if state in _POWERED:
            raise NotAllowed(
                "drive.set-motor-not-enabled",
                drive=self.name,
                parameter=parameter.key,
                key=parameter.name,
            )

    def decode_state(self, status_word: int) -> cia402.State:
        """CiA 402 state, with the family's own reading of the status word."""
        return cia402.decode_state(status_word, echoes_control=self._own_status)

    def fault_bit(self, key: str) -> int | None:
        """The bit of the family's status word that tells of a fault; None of any other object."""
        if key != self.key("status_word"):
            return None
        return cia402.fault_bit(echoes_control=self._own_status)
