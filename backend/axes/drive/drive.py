"""A drive: a profile, the ports it is reached through, and typed reads and writes.

Engineering values are ``raw * scale + offset`` of the parameter. A write is checked on the host
before it is sent (access, type, range, enum, state), then sent, then read back; the value read back
is the result.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from backend.axes.drive.ports import Port, address_of
from backend.axes.drive.readable import ReadableDrive
from backend.axes.drive.readings import CommandRecord, Reading, Refusal, WriteRecord
from backend.axes.drive.value_check import checked, named
from backend.axes.motion.alternatives import refused
from backend.axes.motion.classes import held_still, motion_of
from backend.axes.motion.grant import Grant
from backend.axes.motion.stopping import stops
from drivers import cia402
from drivers.errors import (
    DriveError,
    LinkTimeout,
    NotAllowed,
    OutOfRange,
)
from drivers.objects.codec import encode
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
    """One connected drive: reads, and writes that are checked, granted and read back."""

    def check(self, parameter: Parameter, raw: Raw) -> Raw:
        """Check a raw value and return it as it will be written.

        Raises:
            NotAllowed, OutOfRange: as `backend.axes.drive.value_check.checked`.
        """
        return checked(self.name, self.profile.drive, parameter, raw)

    async def write(self, key: str, value: Raw, *, raw: bool = True) -> Reading:
        """Write one parameter and return what was read back.

        ``value`` is a raw value, or one in the parameter's unit with ``raw=False``.

        Raises:
            NotGranted: the object can energise the motor; the message states where that is done.
            NotAllowed, OutOfRange: the write was refused by the host; nothing was sent.
            Rejected: the drive refused.
            LinkTimeout: the outcome is unknown, and reading back failed as well.
        """
        parameter, value = self.check_write(key, value, raw=raw)
        await self._require_harmless(parameter)
        return await self._written(parameter, value)

    def check_write(self, key: str, value: Raw, *, raw: bool = True) -> tuple[Parameter, Raw]:
        """Check by the profile what `write` would refuse; return the parameter and the raw value.

        Raises:
            NotGranted, NotAllowed, OutOfRange: as `write`.
        """
        self._refuse_energising(key, value)
        return self._to_be_written(key, value, raw=raw)

    async def energise(self, key: str, raw: Raw, grant: Grant) -> Reading:
        """Like `write`, for a raw value of an object that can energise the motor.

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
        """Restore a temporary value, of any motion class, for the work that changed it.

        Raises:
            NotGranted: the object can energise the motor, and the calling work holds no grant.
            DriveError: as `write`.
        """
        if motion_of(self.parameter(key)) != "energises":
            return await self.write(key, raw)
        return await self.energise(key, raw, self.authority.require_held(self.id, self.name, key))

    def require_grant(self, grant: Grant, key: str, *, restores: bool = False) -> None:
        """Check that this grant permits writing this object now.

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
                    self.profile.drive,
                    OutOfRange("drive.no-number", given=value),
                    parameter,
                ) from error
        return parameter, self.check(parameter, value)

    def _refuse_energising(self, key: str, value: Raw) -> None:
        """Raise NotGranted where this object can energise the motor, whatever the value."""
        parameter = self.parameter(key)
        if motion_of(parameter) != "energises":
            return
        self.port_for(parameter)
        error = refused(self.name, self.profile, parameter)
        self.listeners.refused(Refusal(self.id, self.name, parameter.key, value, error.text))
        raise error

    async def _require_harmless(self, parameter: Parameter) -> None:
        """Check that a motion relying on this parameter is neither under way nor possible.

        Raises:
            NotAllowed: a motion relies on the parameter, and the axis is moved or has power.
        """
        if not held_still(parameter):
            return
        if self.authority.held(self.id) is not None:
            return  # the motion itself changes it for its duration
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
        """Write and read back; ``permitted`` is called just before sending and may raise."""
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
            # STOP may have ended the grant during a read, or while another task had exclusive
            # access. Nothing is awaited between this check and the link, which keeps the order of
            # writes.
            permitted()
            return await self._sent_and_read(port, parameter, value)

    async def _sent_and_read(self, port: Port, parameter: Parameter, value: Raw) -> Reading:
        try:
            await self._send(port, parameter, value)
        except DriveError as error:
            raise named(self.name, self.profile.drive, error, parameter, value) from error
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
        """Check that the drive at this station is the one that was connected.

        Raises:
            NotAllowed: another drive answers, and nobody has accepted it.
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
        """Write a value that only ends motion or removes power, without reading back or a grant.

        Raises:
            ValueError: this value can move the axis, so it needs a grant.
            DriveError: as `write`.
        """
        parameter = self.parameter(key)
        if motion_of(parameter) == "energises" and not stops(self.profile, parameter, raw):
            raise ValueError(f"{parameter.key} = {raw} does not only stop")
        await self._sent(parameter, raw)

    async def stop_by(self, key: str, raw: int) -> None:
        """Write a value by which STOP brakes, without reading back or a grant.

        Only for STOP (checked by a test): some values that brake could move an axis at another
        time, such as another mode with the setpoint zero, or halt.

        Raises:
            DriveError: as `write`.
        """
        await self._sent(self.parameter(key), raw)

    async def trigger(self, key: str, raw: int) -> None:
        """Write an object that starts a procedure without motion, without reading back.

        Raises:
            NotGranted: it can energise the motor.
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
                raise named(self.name, self.profile.drive, error, parameter, raw) from error
            raise
        self._notify_command(parameter, raw)

    def _notify_command(self, parameter: Parameter, raw: int, problem: Text | None = None) -> None:
        record = CommandRecord(self.id, self.name, parameter.key, parameter.name, raw, problem)
        self.listeners.commanded(record)

    async def _send(self, port: Port, parameter: Parameter, value: Raw) -> None:
        """Write; after a timeout the outcome is unknown, so it is read back and not repeated."""
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
        """Raise NotAllowed where the motor has power."""
        status = self.key("status_word")
        if status is None:
            return
        try:
            state = self.decode_state(await self.raw(status))
        except DriveError as error:
            # The person knows the parameter that was to be written, not the status word.
            error.parameter = parameter.key
            raise
        if state in _POWERED:
            raise NotAllowed(
                "drive.set-motor-not-enabled",
                drive=self.name,
                parameter=parameter.key,
                key=parameter.name,
            )
