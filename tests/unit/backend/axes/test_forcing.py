"""Overruling terminals: what is refused, what ends a session, and what is restored."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.drive.terminals import ProbeSettings, probe_bits, read_terminals, set_probe
from backend.axes.functions import forcing
from backend.axes.functions.forcing import ForcingSessions
from backend.foundation.people.lease import Leases
from backend.foundation.work.jobs import JobRunner
from drivers.errors import DriveError, LinkTimeout, NotAllowed, OutOfRange, Rejected
from drivers.texts.answers import sentence
from drivers.texts.message import text
from profiles.functions import Forcing, Functions, Probe, TerminalBits, TerminalFacts, TouchProbe
from profiles.schema import IoFunction, IoTerminal, Parameter, Profile, Quirk
from tests.support.memory_link import MemoryLink
from tests.unit.backend.conftest import SPEC, changed

_DO = (
    IoFunction(code=0, name="brake"),
    IoFunction(code=31, name="universal output"),
    IoFunction(code=2, name="ready"),
)
_DI1 = (IoFunction(code=0, name="not used"), IoFunction(code=4, name="touch probe 1"))
_DI2 = (IoFunction(code=0, name="not used"), IoFunction(code=4, name="touch probe 2"))


def _parameter(key: str, type_: str = "UINT32", effective: str = "now") -> Parameter:
    return Parameter.model_validate(
        {"key": key, "name": key, "group": "I/O", "type": type_, "effective": effective,
         "source": "t"}
    )  # fmt: skip


def _objects() -> dict[tuple[int, int], bytes]:
    wide = {(0x60FE, 1): 0x1, (0x60FE, 2): 0, (0x60FD, 0): 0x10000, (0x60B8, 0): 0}
    narrow = {
        (0x2002, 1): 31, (0x2002, 2): 0, (0x2002, 3): 2, (0x2003, 1): 4, (0x2003, 2): 4,
        (0x2003, 3): 4, (0x2031, 2): 0, (0x2031, 3): 0,
    }  # fmt: skip
    return {k: v.to_bytes(4, "little") for k, v in wide.items()} | {
        k: v.to_bytes(2, "little") for k, v in narrow.items()
    }


@pytest.fixture
def io_profile(profile: Profile) -> Profile:
    terminals = (
        *(
            IoTerminal(
                name=f"DO{n}", direction="out", function_key=f"2002:0{n}", functions=_DO, source="t"
            )
            for n in (1, 2, 3)
        ),
        IoTerminal(name="DI1", direction="in", function_key="2003:01", functions=_DI1, source="t"),
        IoTerminal(name="DI2", direction="in", function_key="2003:02", functions=_DI2, source="t"),
        IoTerminal(name="DI3", direction="in", function_key="2003:03", functions=_DI1, source="t"),
    )
    outputs = Forcing(
        name="outputs",
        title="Force outputs",
        help="",
        warning="it acts at once",
        source="t",
        enable=TerminalBits(key="60FE:02", bits={"DO1": 16, "DO2": 17, "DO3": 18}),
        value=TerminalBits(key="60FE:01", bits={"DO1": 16, "DO2": 17, "DO3": 18}),
        needs_function=31,
    )
    simulation = Forcing(
        name="simulation",
        title="Simulate inputs",
        help="",
        warning="it hides",
        source="t",
        enable=TerminalBits(key="2031:02", bits={"DI1": 0, "DI2": 1}),
        value=TerminalBits(key="2031:03", bits={"DI1": 0, "DI2": 1}),
    )
    keys = ["60FE:01", "60FE:02", "60FD:00", "60B8:00"]
    small = [f"2002:0{n}" for n in (1, 2, 3)] + [f"2003:0{n}" for n in (1, 2, 3)]
    parameters = [_parameter(key) for key in keys] + [_parameter(key, "UINT16") for key in small]
    parameters += [_parameter(key, "UINT16", "write_settings") for key in ("2031:02", "2031:03")]
    parameters.append(_parameter("60B9:00", "UINT16"))
    functions = Functions(
        terminals=TerminalFacts(
            states=(TerminalBits(key="60FD:00", bits={"DI1": 16, "DI2": 17}),),
            brake_functions=(0,),
            forcing=(outputs, simulation),
        ),
        probe=TouchProbe(
            function_key="60B8:00",
            status_key="60B9:00",
            source="t",
            probes=(Probe(sources={0: "DI1", 1: "index"}), Probe(sources={0: "DI2"})),
        ),
    )
    settings = Quirk(kind="write_settings", key="200D:01", raw=0xAAB555AA, help="", source="t")
    return changed(
        profile,
        parameters=(*profile.parameters, *parameters),
        terminals=terminals,
        functions=functions,
        quirks=(settings,),
    )


@pytest.fixture
def io_link(link: MemoryLink) -> MemoryLink:
    link.objects |= _objects()
    return link


@pytest.fixture
def axis(io_profile: Profile, io_link: MemoryLink) -> Axis:
    return Axis(Drive("x", "X axis", io_profile, [Port(io_link, 1, SPEC)]))


@pytest.fixture
def sessions() -> ForcingSessions:
    return ForcingSessions(JobRunner(), Leases().taken_by)


def outputs(link: MemoryLink) -> tuple[int, int]:
    """Value and mask of 60FEh."""
    return tuple(int.from_bytes(link.objects[0x60FE, sub], "little") for sub in (1, 2))  # type: ignore[return-value]


async def ended(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110 - a dictionary has no event
            await asyncio.sleep(0.01)


async def test_force_and_release_in_the_right_order(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions
) -> None:
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.set({"DO1": True})
    # Other bits stay as they were.
    assert outputs(io_link) == (0x10001, 0x10000)
    # The value was there before the terminal followed it.
    assert [place for place, _ in io_link.written] == [(0x60FE, 1), (0x60FE, 2)]
    io_link.written.clear()
    await session.set({"DO1": None})
    assert outputs(io_link) == (0x1, 0)
    # It was let go before its value went back.
    assert [place for place, _ in io_link.written] == [(0x60FE, 2), (0x60FE, 1)]
    await sessions.end("x", "outputs")


async def test_everything_is_put_back_at_the_end(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions
) -> None:
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.set({"DO1": True})
    await sessions.end("x", "outputs")
    assert outputs(io_link) == (0x1, 0)
    assert sessions.get("x", "outputs") is None
    assert session.job is not None
    assert session.job.result == sentence("reason", text("functions.end-by-page"))


@pytest.mark.parametrize(
    ("wanted", "error", "words"),
    [
        ({"DO2": True}, NotAllowed, "brake"),
        ({"DO3": True}, NotAllowed, "universal output"),
        ({"DO9": True}, OutOfRange, "DO9"),
    ],
)
async def test_what_must_not_be_forced_is_refused(
    axis: Axis,
    io_link: MemoryLink,
    sessions: ForcingSessions,
    wanted: dict[str, bool | None],
    error: type[DriveError],
    words: str,
) -> None:
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    with pytest.raises(error, match=words):
        await session.set({"DO1": True, **wanted})
    assert io_link.written == []
    await sessions.end("x", "outputs")


async def test_no_session_without_agreement_and_only_one(
    axis: Axis, sessions: ForcingSessions
) -> None:
    with pytest.raises(NotAllowed, match="it acts at once"):
        await sessions.start(axis, "outputs", confirmed=False, connection="me")
    await sessions.start(axis, "outputs", confirmed=True, connection="me")
    with pytest.raises(NotAllowed, match="in use already"):
        await sessions.start(axis, "outputs", confirmed=True, connection="you")
    await sessions.end("x", "outputs")


async def test_a_silent_page_ends_it(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.set({"DO1": True})
    monkeypatch.setattr(forcing, "SILENT_S", 0.0)
    await ended(lambda: sessions.get("x", "outputs") is None)
    assert session.reason == text("work.page-not-reachable", silent_s=0.0)
    assert outputs(io_link) == (0x1, 0)


async def test_stop_ends_it(axis: Axis, io_link: MemoryLink, sessions: ForcingSessions) -> None:
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.set({"DO1": True})
    axis.stopped = True
    await ended(lambda: sessions.get("x", "outputs") is None)
    assert session.reason == text("motion.stop-was-pressed")
    assert outputs(io_link) == (0x1, 0)


async def test_control_that_passes_to_another_ends_it(axis: Axis, io_link: MemoryLink) -> None:
    leases = Leases()
    sessions = ForcingSessions(JobRunner(), leases.taken_by)
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.set({"DO1": True})
    leases.take("x", "other", "Kim")
    await ended(lambda: sessions.get("x", "outputs") is None)
    assert session.reason == text("work.control-taken", person="Kim")
    assert outputs(io_link) == (0x1, 0)


async def test_a_cancelled_job_puts_back_too(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions
) -> None:
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.set({"DO1": True})
    assert session.job is not None
    assert session.job.task is not None
    session.job.task.cancel()
    await ended(lambda: sessions.get("x", "outputs") is None)
    assert outputs(io_link) == (0x1, 0)


async def test_real_terminals_that_do_not_count_again_are_pending(
    axis: Axis, sessions: ForcingSessions, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The values are back, and the drive goes on with simulated inputs: limits among them."""
    session = await sessions.start(axis, "simulation", confirmed=True, connection="me")

    async def lost(*_what: object) -> None:
        raise LinkTimeout("no answer")

    monkeypatch.setattr(forcing, "apply_settings", lost)
    axis.stopped = True
    await ended(lambda: sessions.get("x", "simulation") is None)
    assert session.job is not None
    assert isinstance(session.job.error, LinkTimeout)
    entries = {entry.key: entry.unapplied for entry in axis.drive.pending_restores.entries}
    assert entries == {"2031:02": True, "2031:03": True}


@pytest.mark.parametrize("how", ["cancelled", "STOP"])
async def test_what_comes_while_it_ends_overrules_nothing_any_more(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions, how: str
) -> None:
    """A request that waits for the one before it came through after all had been restored."""
    session = await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await session.lock.acquire()  # as a write that is under way
    late = asyncio.create_task(session.set({"DO1": True}))
    await asyncio.sleep(0.01)
    if how == "STOP":
        axis.stopped = True
    else:
        assert session.job is not None
        assert session.job.task is not None
        session.job.task.cancel()
    await ended(lambda: session.over)
    session.lock.release()
    with pytest.raises(NotAllowed, match="has ended"):
        await late
    await ended(lambda: sessions.get("x", "outputs") is None)
    assert outputs(io_link) == (0x1, 0)


async def test_an_unreadable_object_begins_nothing(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions
) -> None:
    io_link.read_errors[0x60FE, 1] = LinkTimeout("no answer")
    with pytest.raises(LinkTimeout):
        await sessions.start(axis, "outputs", confirmed=True, connection="me")
    await ended(lambda: sessions.get("x", "outputs") is None)


async def test_simulation_is_made_to_act_and_let_go(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions
) -> None:
    session = await sessions.start(axis, "simulation", confirmed=True, connection="me")
    await session.set({"DI1": True})
    places = [place for place, _ in io_link.written]
    assert places == [(0x2031, 3), (0x2031, 2), (0x200D, 1)]
    io_link.written.clear()
    await sessions.end("x", "simulation")
    # Put back, and made to act.
    assert [place for place, _ in io_link.written] == [(0x2031, 2), (0x2031, 3), (0x200D, 1)]


async def test_simulation_makes_nothing_else_act_by_the_way(
    axis: Axis, sessions: ForcingSessions
) -> None:
    await axis.drive.write("2005:03", 500)
    session = await sessions.start(axis, "simulation", confirmed=True, connection="me")
    with pytest.raises(NotAllowed, match="2005:03"):
        await session.set({"DI1": True})
    await sessions.end("x", "simulation")


async def test_simulation_is_not_begun_under_power(
    axis: Axis, io_link: MemoryLink, sessions: ForcingSessions
) -> None:
    session = await sessions.start(axis, "simulation", confirmed=True, connection="me")
    io_link.objects[0x6041, 0] = (0x0237).to_bytes(2, "little")
    with pytest.raises(NotAllowed, match="not enabled"):
        await session.set({"DI1": True})
    io_link.objects[0x6041, 0] = (0x0250).to_bytes(2, "little")
    await sessions.end("x", "simulation")


async def test_terminals_with_the_same_function_are_reported_by_name(axis: Axis) -> None:
    found = {state.terminal.name: state for state in await read_terminals(axis.drive)}
    # Code 4 is probe 1 at DI1 and DI3, and probe 2 at DI2.
    assert found["DI1"].same_function == ("DI3",)
    assert found["DI2"].same_function == ()
    assert found["DI1"].on is True
    assert found["DI2"].on is False
    assert found["DO1"].on is None
    assert found["DO1"].function_name == "universal output"


def test_probe_bits() -> None:
    # 004:4670: 0x0013 is probe 1 on, continuous, rising edge.
    assert probe_bits(ProbeSettings(True, True, True, False)) == 0x13
    assert probe_bits(ProbeSettings(True, False, False, True, source=1)) == 0x25


async def test_probe_two_leaves_probe_one_alone(axis: Axis, io_link: MemoryLink) -> None:
    await set_probe(axis.drive, 1, ProbeSettings(True, True, True, False))
    reading = await set_probe(axis.drive, 2, ProbeSettings(True, False, False, True))
    assert reading.raw == 0x2113
    io_link.written.clear()
    await set_probe(axis.drive, 1, ProbeSettings(True, False, True, True))
    # Off first: settings are adopted when the probe is switched on.
    values = [int.from_bytes(data, "little") for _, data in io_link.written]
    assert values == [0x2100, 0x2131]


async def test_probe_refusals(axis: Axis, io_link: MemoryLink) -> None:
    with pytest.raises(OutOfRange, match="no source 1"):
        await set_probe(axis.drive, 2, ProbeSettings(True, False, True, False, source=1))
    with pytest.raises(OutOfRange, match="no edge"):
        await set_probe(axis.drive, 1, ProbeSettings(True, False, False, False))
    with pytest.raises(NotAllowed, match="no touch probe 3"):
        await set_probe(axis.drive, 3, ProbeSettings(True, False, True, False))
    io_link.loses_writes = True
    with pytest.raises(Rejected, match="does not keep"):
        await set_probe(axis.drive, 1, ProbeSettings(True, False, True, False))
