"""How often the doctor's first cause is the injected one: ``python -m benchmarks.doctor``.

Each cause is injected into a virtual slave in a private network, or a virtual node on a CAN bus
(`benchmarks.doctor_canopen`), the slave is brought to
Operational as `servodeck doctor` does it, and the first diagnosis is compared. ``how`` says
whether the trouble is a real one of the wire or the configuration ("real"), or the slave was
only made to refuse with the AL status code that the cause has in ETG.1020 ("code").
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from backend.station.doctor import examined
from benchmarks.doctor_canopen import CASES as CAN_CASES
from benchmarks.doctor_canopen import CanCase, causes_of
from drivers.errors import DriveError
from drivers.ethercat.link import EthercatLink
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace, unavailable
from profiles.bring_up import BringUp, ClockMode, InitCommand
from profiles.schema import Profile
from tests.wire.ethercat_host.servo_device import servo_profile

_FACTORY = "tests.wire.ethercat_host.servo_device:make_servo"
_NEEDED = 0.95

Prepare = Callable[[VirtualSegment], object]
Change = Callable[[Profile], Profile]


def _nothing(_segment: VirtualSegment) -> object:
    return None


def _as_it_is(profile: Profile) -> Profile:
    return profile


@dataclass(frozen=True)
class Case:
    """One injected cause."""

    cause: str
    name: str
    how: str = "code"
    prepare: Prepare = _nothing
    change: Change = _as_it_is
    drive: str = "servo"


def _refusing(state: str, code: int) -> Prepare:
    return lambda segment: segment.command("refuse", slave=0, state=state, code=code)


def _also(first: Prepare, second: Prepare) -> Prepare:
    def both(segment: VirtualSegment) -> None:
        first(segment)
        second(segment)

    return both


def _with(profile: Profile, **changes: object) -> Profile:
    fields = {name: getattr(profile, name) for name in Profile.model_fields}
    return Profile(**(fields | changes))


def _rules(**rules: object) -> Change:
    return lambda p: _with(p, bring_up=BringUp(source="injected", **rules))


def _identity(**other: int) -> Change:
    return lambda p: _with(p, identity=p.identity.model_copy(update=other))


def _command(index: int, data: str) -> Change:
    command = InitCommand(transition="PS", index=index, subindex=0, data=data)
    return _rules(init_commands=(command,))


CASES: tuple[Case, ...] = (
    Case("station_silent", "supply off", "real",
         lambda s: s.command("power_off", slave=0)),
    Case("init_command_refused", "init command to a read-only object", "real",
         change=_command(0x6041, "0000")),
    Case("init_command_refused", "init command to a missing object", "real",
         change=_command(0x3FFF, "00")),
    Case("mapping_locked", "mapping written, drive's is fixed", "real", drive="fixed"),
    Case("cycle_refused", "SYNC0 of 40 ms", "real",
         change=_rules(clock_modes=(ClockMode(name="DC", assign_activate=0x300,
                                              sync0={"cycle_ns": 40_000_000}),))),
    Case("other_product", "profile of another product", "real", _refusing("SAFEOP", 0x1D),
         _identity(product_code=0x9999)),
    Case("other_product", "profile of another maker", "real", _refusing("SAFEOP", 0x1E),
         _identity(vendor_id=0x9999)),
    Case("other_revision", "profile of another revision", "real", _refusing("SAFEOP", 0x25),
         _identity(revision=0x7777)),
    Case("drive_fault", "fault of the drive", "real",
         _also(lambda s: s.command("inject", slave=0, what="fault", value=0x7305),
               _refusing("SAFEOP", 0x0001))),
    Case("eeprom_busy", "EEPROM busy", "code", _refusing("SAFEOP", 0x0050)),
    Case("eeprom_damaged", "EEPROM of another firmware", "code", _refusing("SAFEOP", 0x0006)),
    Case("eeprom_damaged", "EEPROM error", "code", _refusing("SAFEOP", 0x0051)),
    Case("restart_needed", "out of memory", "code", _refusing("SAFEOP", 0x0002)),
    Case("modules_differ", "invalid set-up", "code", _refusing("SAFEOP", 0x0003)),
    Case("process_data_setup", "sync manager types", "code", _refusing("SAFEOP", 0x001C)),
    Case("process_data_setup", "sync manager configuration", "code", _refusing("SAFEOP", 0x0017)),
    Case("outputs_size", "output configuration", "code", _refusing("SAFEOP", 0x001D)),
    Case("inputs_size", "input configuration", "code", _refusing("SAFEOP", 0x001E)),
    Case("inputs_size", "input mapping", "code", _refusing("SAFEOP", 0x0024)),
    Case("outputs_size", "output mapping", "code", _refusing("SAFEOP", 0x0025)),
    Case("watchdog_refused", "watchdog too short", "code", _refusing("SAFEOP", 0x001F)),
    Case("clock_mode_wrong", "AssignActivate wrong", "code", _refusing("SAFEOP", 0x0030)),
    Case("clock_mode_wrong", "synchronisation not supported", "code", _refusing("SAFEOP", 0x0028)),
    Case("clock_needed", "free run not supported", "code", _refusing("SAFEOP", 0x0027)),
    Case("cycle_refused", "SYNC0 cycle", "code", _refusing("SAFEOP", 0x0036)),
    Case("sync0_unsteady", "PLL not locked", "code", _refusing("OP", 0x0032)),
    Case("sync0_unsteady", "synchronisation lost", "code", _refusing("OP", 0x002C)),
    Case("power_stage", "hardware not ready", "code", _refusing("OP", 0x0052)),
    Case("supply_low", "supply too low", "code", _refusing("OP", 0x0063)),
    Case("supply_high", "supply too high", "code", _refusing("OP", 0x0064)),
    Case("temperature", "too hot", "code", _refusing("OP", 0x0066)),
    Case("no_outputs", "no valid outputs", "code", _refusing("OP", 0x0019)),
    Case("restart_needed", "cold start", "code", _refusing("SAFEOP", 0x0020)),
    Case("no_firmware", "no valid firmware", "code", _refusing("SAFEOP", 0x0014)),
    Case("makers_code", "code of the maker", "code", _refusing("SAFEOP", 0x8123)),
)  # fmt: skip


async def first_cause(namespace: Namespace, case: Case) -> str:
    """What the doctor says first; empty where the drive reaches Operational all the same."""
    arguments = ["--factory", _FACTORY, "--lockstep", "--sdo-ms", "0.3", "--drive", case.drive]
    with VirtualSegment.start("ec0s", arguments, namespace) as segment:
        link = EthercatLink(
            "ec0m", url="ethercat://virtual0", launcher=namespace.command([]), lockstep=1.0
        )
        await link.open()
        try:
            await link.scan(lambda _share, _text: None)
            link.attach(1, case.change(servo_profile()))
            case.prepare(segment)
            result = await examined(link, 1)
        finally:
            await link.close()
    return result.causes[0].code if result.causes else ""


async def table(namespace: Namespace, cases: tuple[Case, ...] = CASES) -> list[tuple[Case, str]]:
    """All cases with what the doctor says of each first."""
    found: list[tuple[Case, str]] = []
    for case in cases:
        try:
            reported = await first_cause(namespace, case)
        except DriveError as error:
            reported = f"({error.kind})"
        found.append((case, reported))
        _show(case, reported)
    return found


async def table_of_can(cases: tuple[CanCase, ...] = CAN_CASES) -> list[tuple[CanCase, str]]:
    """As `table`, of CANopen."""
    found: list[tuple[CanCase, str]] = []
    for case in cases:
        try:
            causes = await causes_of(case)
        except (DriveError, TimeoutError) as error:
            causes = [f"({type(error).__name__})"]
        found.append((case, causes[0] if causes else ""))
        _show(*found[-1])
    return found


def _show(case: Case | CanCase, reported: str) -> None:
    mark = "right" if reported == case.cause else "WRONG"
    print(f"{mark:6} {case.how:5} {case.name:40} {case.cause:24} {reported}", flush=True)


def main() -> int:
    """Print the table; 1 where too few first diagnoses are right."""
    parser = argparse.ArgumentParser(description="the doctor's first cause against injected ones")
    parser.add_argument("--first", type=int, default=1, help="number of the first case")
    parser.add_argument("--count", type=int, default=1000, help="how many cases")
    parser.add_argument("--bus", choices=("ethercat", "canopen"), help="only this one")
    options = parser.parse_args()
    right = [run(options) for bus, run in _BUSES.items() if options.bus in (None, bus)]
    return max(right)


def _ethercat(options: argparse.Namespace) -> int:
    cases = CASES[options.first - 1 :][: options.count]
    reason = unavailable()
    if reason is not None:
        print(reason, file=sys.stderr)
        return 2
    with Namespace.create() as namespace:
        found = asyncio.run(table(namespace, cases))
    return _verdict("EtherCAT", found)


def _canopen(options: argparse.Namespace) -> int:
    cases = CAN_CASES[options.first - 1 :][: options.count]
    return _verdict("CANopen", asyncio.run(table_of_can(cases)))


def _verdict(bus: str, found: Sequence[tuple[Case | CanCase, str]]) -> int:
    right = sum(reported == case.cause for case, reported in found)
    real = [(case, reported) for case, reported in found if case.how == "real"]
    print(
        f"{bus}: {right} of {len(found)} first diagnoses are right "
        f"({sum(t == c.cause for c, t in real)} of {len(real)} real ones)"
    )
    return 0 if right >= _NEEDED * len(found) else 1


_BUSES = {"ethercat": _ethercat, "canopen": _canopen}

if __name__ == "__main__":
    sys.exit(main())
