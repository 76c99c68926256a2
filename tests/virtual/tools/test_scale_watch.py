"""Scales are certain or nothing moves: drives of other units, and drives whose 606Ch is wrong.

On the EtherCAT loop (`direct`) and over CANopen frames (`can_bench`). What goes out is read where
it goes out, and what the shaft does from its mechanics, not from what the tools say.
"""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from backend.axes.axis import teaching
from backend.axes.axis.axis import Envelope
from backend.axes.scales.scale import Origin, ScaleUnknown, Uncertainty
from backend.tools.measuring.interrupted import Interrupted
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.moving.jog.cyclic import GeneratorSettings, generate, jog_cyclic
from backend.tools.moving.jog.run import Hold, JogSettings, jog
from backend.tools.moving.moves.homing import HomingSettings, home
from backend.tools.moving.moves.move import MoveSettings, SequenceSettings, move, sequence
from backend.tools.moving.moves.small_move import SmallMoveSettings, small_move
from backend.tools.moving.step.evaluate import StepSettings
from backend.tools.moving.step.run import step_response
from backend.tools.tuning.autotune.run import AutotuneSettings, autotune
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.errors import MotionHalted, NotAllowed, OutOfRange
from drivers.halt import HaltCause
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.mechanics.rough_feedback import RoughFeedbackSpec
from tests.virtual.tools.can_rig import can_bench
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import AMPLE_S, mechanics, silent

RPM_CODE = 0x00B44700  # CiA 303-2: revolutions per minute
TENTH_RPM_CODE = 0xFFB44700
RPM_S_CODE = 0x00B44700
AXIS = mechanics((1e-4, 60.0, 0.006))
ENVELOPE = Envelope(3.0, 600.0, 100.0, 20.0)
SPIN = GeneratorSettings(
    "CSV", "ramp", 60.0, 2.0, Envelope(5.0, 200.0, 100.0, 10.0), acceleration=200.0
)


def rough(**options: Any) -> MechanicsSpec:
    return AXIS.model_copy(update={"rough_feedback": RoughFeedbackSpec(**options)})


@asynccontextmanager
async def bench(bus: str, spec: MechanicsSpec) -> AsyncIterator[Any]:
    made: Any = (
        direct(spec, drive="generic402")
        if bus == "ethercat"
        else can_bench(spec, drive="generic402", pace=20.0)
    )
    async with made as b:
        yield b


async def largest_command(b: Any, settings: GeneratorSettings) -> int:
    """The largest 60FFh that went out while this was played."""
    sent: list[int] = []
    play = b.session.cyclic.play

    async def noted(trajectories: Any) -> int:
        sent.extend(int(v) for t in trajectories for v in t.values)
        return int(await play(trajectories))

    b.session.cyclic.play = noted
    await generate(b.axis, b.session, settings, silent())
    return max(sent)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("bus", ["ethercat", "canopen"])
async def test_60_rpm_is_sent_as_60_to_a_drive_that_counts_rpm(bus: str) -> None:
    """60A9h = 00B44700h. In increments per second it would be 10 000 and more."""
    async with bench(bus, rough(velocity_unit=RPM_CODE)) as b:
        units = await b.axis.units()
        assert units.scales.velocity.origin is Origin.DRIVE
        assert units.scales.velocity.raw_unit == "rpm"
        assert await largest_command(b, SPIN) == 60


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("bus", ["ethercat", "canopen"])
async def test_a_tenth_of_an_rpm_is_sent_as_it_is_stated(bus: str) -> None:
    async with bench(bus, rough(velocity_unit=TENTH_RPM_CODE)) as b:
        assert await largest_command(b, SPIN) == 600


@pytest.mark.long(keep=3)
@pytest.mark.parametrize("bus", ["ethercat", "canopen"])
@pytest.mark.parametrize(
    ("options", "means"),
    [
        ({"velocity_unit": RPM_CODE, "speed_factor": 10.0}, "the scale of 606Ch"),
        ({"speed_factor": 0.0}, "606Ch does not follow"),
        ({"speed_factor": -1.0}, "wrong sign"),
    ],
)
async def test_a_606c_that_contradicts_the_position_ends_the_motion(
    bus: str, options: dict[str, Any], means: str
) -> None:
    spin = GeneratorSettings(
        "CSV", "ramp", 300.0, 3.0, Envelope(20.0, 400.0, 100.0, 10.0), acceleration=1000.0
    )
    async with bench(bus, rough(**options)) as b:
        with pytest.raises(MotionHalted, match=means) as ended:
            await generate(b.axis, b.session, spin, silent())
        assert ended.value.halt.cause is HaltCause.CONTRADICTION
        assert "606Ch reads" in ended.value.message
        assert "rpm, the position gives" in ended.value.message


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("bus", ["ethercat", "canopen"])
@pytest.mark.parametrize(
    "options",
    [
        {"speed_late_s": 1e-3},
        {"speed_mean_s": 3e-3},
        {"speed_step_rpm": 10.0},
        {"speed_late_s": 1e-3, "speed_mean_s": 2e-3, "speed_step_rpm": 1.0},
    ],
)
async def test_a_606c_that_lags_averages_or_rounds_goes_on(
    bus: str, options: dict[str, Any]
) -> None:
    spin = GeneratorSettings(
        "CSV", "sine", 300.0, 2.0, Envelope(20.0, 500.0, 200.0, 10.0), frequency_hz=2.0
    )
    async with bench(bus, rough(**options)) as b:
        played = await generate(b.axis, b.session, spin, silent())
        assert played["cycles"] == 2000


async def test_a_speed_beyond_its_limit_ends_by_the_position_where_606c_stands_still() -> None:
    """A commanded 300 rpm against a limit of 100: the shaft turns less than a quarter turn."""
    async with direct(rough(speed_factor=0.0), drive="generic402") as b:
        units, start = await b.axis.units(), b.link.device.axis.angle_rad
        spin = GeneratorSettings(
            "CSV", "ramp", 100.0, 2.0, Envelope(20.0, 100.0, 100.0, 10.0), acceleration=1e4
        )
        b.axis._units = units  # the drive that is asked for 100 makes 300 of it below
        b.link.device.core.units = _faster(b.link.device.core.units, 3.0)
        with pytest.raises(MotionHalted) as ended:
            await generate(b.axis, b.session, spin, silent())
        assert ended.value.halt.cause is HaltCause.CONTRADICTION
        turned = abs(b.link.device.axis.angle_rad - start) / (2 * math.pi)
    assert turned < 0.6


def _faster(units: Any, factor: float) -> Any:
    from dataclasses import replace

    return replace(units, speed_per_rad_s=units.speed_per_rad_s / factor)


async def test_measurements_do_not_compute_from_a_606c_that_is_wrong() -> None:
    """606Ch in another unit than stated, of a slow move: the recording shows it."""
    async with direct(rough(speed_factor=0.5), drive="generic402") as b:
        settings = InertiaSettings(Envelope(2.0, 300.0, 100.0, 30.0), rated_torque_nm=1.27)
        with pytest.raises((Interrupted, MotionHalted), match="606Ch reads"):
            await inertia(b.axis, b.session, settings, silent())


LACKING = rough(lacks=("60A9", "60AA"))
UNKNOWN_RESOLUTION = rough(lacks=("6092", "608F"))
SAYS_LITTLE = {"no unit": LACKING, "no resolution": UNKNOWN_RESOLUTION}

TOOLS: dict[str, Any] = {
    "jog": lambda b: jog_cyclic(
        b.axis, b.session, JogSettings(1, 60.0, 600.0, 1.0, 50.0), Hold(), silent()
    ),
    "jog without an exchange": lambda b: jog(
        b.axis, JogSettings(1, 60.0, 600.0, 1.0, 50.0), Hold(), silent()
    ),
    "move": lambda b: move(b.axis, MoveSettings("PP", 1.0, ENVELOPE), silent()),
    "velocity": lambda b: move(b.axis, MoveSettings("PV", 60.0, ENVELOPE, consent=True), silent()),
    "torque": lambda b: move(b.axis, MoveSettings("PT", 5.0, ENVELOPE, consent=True), silent()),
    "sequence": lambda b: sequence(
        b.axis, SequenceSettings(0.0, 1.0, 60.0, 600.0, 0.1, 1, ENVELOPE), silent()
    ),
    "home": lambda b: home(b.axis, HomingSettings(35, ENVELOPE), silent()),
    "inertia": lambda b: inertia(b.axis, b.session, InertiaSettings(ENVELOPE), silent()),
    "sweep": lambda b: sweep(b.axis, b.session, SweepSettings(ENVELOPE), silent()),
    "step": lambda b: step_response(b.axis, b.session, StepSettings(ENVELOPE), silent()),
    "autotune": lambda b: autotune(
        b.axis, b.session, AutotuneSettings(ENVELOPE, budget_s=AMPLE_S), silent()
    ),
    "generate CSP": lambda b: generate(
        b.axis, b.session, GeneratorSettings("CSP", "sine", 0.1, 1.0, ENVELOPE), silent()
    ),
    "generate CST": lambda b: generate(
        b.axis, b.session, GeneratorSettings("CST", "sine", 5.0, 1.0, ENVELOPE), silent()
    ),
}


@pytest.mark.parametrize("little", SAYS_LITTLE)
@pytest.mark.parametrize("tool", TOOLS)
async def test_no_tool_moves_by_a_unit_that_nobody_knows(tool: str, little: str) -> None:
    """3 rev are not 3 increments: nothing is written and the shaft is at standstill."""
    async with direct(SAYS_LITTLE[little], drive="generic402") as b:
        b.session.cyclic.play = _must_not_play
        stood = b.link.device.axis.angle_rad
        with pytest.raises(ScaleUnknown) as refused:
            await TOOLS[tool](b)
        assert refused.value.remedy is not None
        assert "teach it" in refused.value.remedy
        assert not b.link.device.axis.powered
        assert b.link.device.axis.angle_rad == pytest.approx(stood, abs=1e-4)  # encoder noise


async def _must_not_play(_trajectories: Any) -> int:
    raise AssertionError("a setpoint went out")


async def test_608f_alone_gives_the_resolution() -> None:
    """An encoder of 2¹⁷ increments, no feed constant: one rev asked is one rev of the shaft."""
    encoder = AXIS.encoder.model_copy(update={"counts_per_rev": 2**17})
    spec = rough(lacks=("6092",)).model_copy(update={"encoder": encoder})
    async with direct(spec, drive="generic402") as b:
        units = await b.axis.units()
        assert units.counts_per_rev == 2**17
        assert (units.scales.position.origin, units.scales.position.source) == (
            Origin.DRIVE,
            "608Fh, 6091h",
        )
        before = b.link.device.axis.angle_rad
        turn = GeneratorSettings(
            "CSP", "ramp", 1.0, 4.0, Envelope(2.0, 200.0, 100.0, 10.0), acceleration=1.0
        )
        seen: list[float] = []
        play = b.session.cyclic.play

        async def noted(trajectories: Any) -> int:
            seen.append(max(float(v) for v in trajectories[0].values))
            return int(await play(trajectories))

        b.session.cyclic.play = noted
        start = await b.axis.position_raw()
        await generate(b.axis, b.session, turn, silent())
        # Between both reads of the position lies the noise of the encoder.
        assert seen[0] - start == pytest.approx(2**17, abs=16)
        assert b.link.device.axis.angle_rad == pytest.approx(before, abs=0.05)


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("bus", ["ethercat", "canopen"])
async def test_a_small_move_teaches_resolution_and_unit(bus: str) -> None:
    """A drive in 0.1 rpm that says nothing of it, 10 000 increments to the revolution."""
    spec = rough(velocity_unit=TENTH_RPM_CODE, lacks=("6092", "608F", "60A9", "60A8"))
    async with bench(bus, spec) as b:
        units = await b.axis.units()
        assert units.scales.position.uncertainty is Uncertainty.NO_RESOLUTION
        assert units.scales.velocity.uncertainty is Uncertainty.NOT_STATED
        with pytest.raises(OutOfRange, match="1 to 1000 increments now"):
            await small_move(b.axis, b.session, SmallMoveSettings(5_000), silent())
        for increments in (500, 5_000):
            await small_move(b.axis, b.session, SmallMoveSettings(increments), silent())
        taught = await teaching.confirmed(b.axis, 0.5)
        assert taught.counts_per_rev == pytest.approx(10_000, rel=0.001)
        assert taught.raw_per_rpm == 10.0
        assert taught.velocity_origin == "measured"
        b.axis.teach(taught)
        units = await b.axis.units()
        assert units.scales.position.origin is Origin.USER
        assert units.scales.velocity.origin is Origin.MEASURED
        assert await largest_command(b, SPIN) == 600


async def test_what_was_taught_ends_with_another_gear() -> None:
    async with direct(LACKING, drive="generic402") as b:
        b.axis.teach(await teaching.stated(b.axis, None, 10_000 / 60.0, None))
        assert (await b.axis.units()).scales.velocity.certain
        await b.axis.drive.write("6091:01", 2)
        b.axis.forget_scales()
        assert not (await b.axis.units()).scales.velocity.certain


async def test_a_small_move_of_a_blocked_axis_teaches_nothing() -> None:
    """End stops on both sides: its torque stays within its limit, and nothing is concluded."""
    spec = mechanics((1e-4, 200.0, 0.005), travel=(-0.01, 0.01)).model_copy(
        update={"rough_feedback": RoughFeedbackSpec(lacks=("60A9",))}
    )
    async with direct(spec, drive="generic402") as b:
        b.axis.moved_small(1_000, None)
        with pytest.raises(NotAllowed):
            await small_move(b.axis, b.session, SmallMoveSettings(10_000, 15.0), silent())
        assert b.axis.small_moves is not None
        assert b.axis.small_moves.moved == 1_000
        assert b.link.highest["torque"] <= 150 + 5


@pytest.mark.long
@pytest.mark.parametrize("opens_s", [0.0, 0.3])
async def test_a_brake_that_opens_late_is_waited_for(opens_s: float) -> None:
    """It grips with twice the rated torque for 300 ms of Operation enabled; no bit reports it."""
    motor = AXIS.motor.model_copy(update={"brake": True})
    spec = rough(brake_opens_s=opens_s).model_copy(update={"motor": motor})
    async with direct(spec, drive="generic402") as b:
        settings = InertiaSettings(Envelope(3.0, 600.0, 80.0, 60.0), rated_torque_nm=1.27)
        outcome = await inertia(b.axis, b.session, settings, silent())
    found = outcome.result.inertia_kgm2.value
    assert found == pytest.approx(spec.total_inertia_kgm2, rel=0.03)
