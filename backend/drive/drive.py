"""A drive: a profile, the ports it is reached through, and typed reads and writes.

Engineering values are ``raw * scale + offset`` of the parameter. A write is checked on the host
before a byte leaves (access, type, range, enum, state), then written, then read back: what
counts is the value that came back.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from backend.drive.ports import Port, address_of
from backend.drive.readable import ReadableDrive
from backend.drive.readings import CommandRecord, Reading, Refusal, WriteRecord
from backend.drive.value_check import checked, named
from backend.motion.alternatives import refused
from backend.motion.classes import held_still, motion_of
from backend.motion.grant import Grant
from backend.motion.stopping import stops
from drivers import cia402
from drivers.codec import encode
from drivers.errors import (
    DriveError,
    LinkTimeout,
    NotAllowed,
    OutOfRange,
)
from drivers.texts.message import Text, text
from profiles.schema import Parameter, Raw

#: States in which the motor has power (CiA 402-2 table 28).
_POWERED = frozenset(
    {
        cia402.State.OPERATION_ENABLED,
        cia402.State.QUICK_STOP_ACTIVE,
        cia402.State.FAULT_REACTION,
    }
)


class Drive(ReadableDrive):
    """One drive of the bench: reads, and writes that are checked, granted and read back."""

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
        """Write a temporary value back, of whatever class, by the work that had changed it.

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
            self._notify_write(parameter, before, value, None, problem)
            raise
        self._notify_write(parameter, before, value, reading.raw)
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

    def _notify_write(
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
            self._notify_command(parameter, raw, problem)
            if isinstance(error, DriveError):
                raise named(self.name, error, parameter, raw) from error
            raise
        self._notify_command(parameter, raw)

    def _notify_command(self, parameter: Parameter, raw: int, problem: Text | None = None) -> None:
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
