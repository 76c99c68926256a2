"""Every tool that moves, by the registry: no motion by a scale that is unknown or out of date.

Another client changes feed constant or gear of the drive after its scales were read. What goes out
then is judged by the drive's own gear, not by what the tools say.
"""

from __future__ import annotations

from typing import Any

import pytest

from backend.axes.axis import scaled, teaching
from backend.axes.scales.scale import ScaleChanged, ScaleUnknown
from backend.tools.measuring.recording import enabled
from backend.tools.mechanics.first_power.result import FirstPowerResult
from backend.tools.moving.moves.small_move import SmallMoveSettings, longest_allowed, small_move
from backend.tools.registry import TOOLS
from backend.tools.tool import AnyTool, Run
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.mechanics.load_encoder import LoadEncoderSpec
from drivers.virtual.mechanics.rough_feedback import RoughFeedbackSpec
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import mechanics, silent

MOVING = [tool for tool in TOOLS if tool.motion]
KINDS = [tool.kind for tool in MOVING]
TRAVEL_REV, SPEED_RPM = 3.0, 300.0
#: Settings that a tool needs, or that differ because its limits are narrower.
MORE: dict[str, dict[str, Any]] = {
    "brake-test": {
        "brake_rated_nm": 1.0, "nothing_hangs": True, "travel_limit": 0.02, "speed_limit": 120.0,
        "torque_limit": 130.0, "brake_supply_cut": True,
    },
    "first-power": {
        "nothing_hangs": True, "hand_turn": False, "hand_switches": False, "travel_limit": 0.1,
        "torque_limit": 10.0,
    },
    "gantry": {"partner": "y"},
    "load-side": {"gear_ratio": 1.0},
    "safety-check": {
        "device": "door", "person": "Anna", "nothing_hangs": True, "speed_rpm": 100.0,
    },
    "shaping": {"size": 0.5, "speed": 100.0, "acceleration": 1000.0},
    "dwell": {"frequency_hz": 30.0, "turn_rpm": 30.0},
}  # fmt: skip
#: Tools that an unlisted drive refuses for another reason, which is no motion either.
REFUSED_ANYWAY = {"autotune", "gantry"}


def spec_of(**options: Any) -> MechanicsSpec:
    spec = mechanics((1e-4, 60.0, 0.006))
    motor = spec.motor.model_copy(update={"brake": True})
    return spec.model_copy(
        update={
            "rough_feedback": RoughFeedbackSpec(**options),
            "motor": motor,
            "load_encoder": LoadEncoderSpec(counts_per_rev=131_072),
        }
    )


def begun(tool: AnyTool, b: Any) -> Any:
    asked = {
        "travel_limit": TRAVEL_REV,
        "speed_limit": SPEED_RPM,
        "torque_limit": 80.0,
        "rated_torque_nm": 1.27,
        **MORE.get(tool.kind, {}),
    }
    run = Run(b.axis, b.session, silent(), partner=b.axis if tool.pair else None)
    return tool.run(run, tool.settings(**asked))


@pytest.mark.long(keep=21)
@pytest.mark.parametrize("lacks", [("60A9", "60AA"), ("6092", "608F")], ids=["unit", "resolution"])
@pytest.mark.parametrize("kind", KINDS)
async def test_no_tool_moves_by_a_unit_that_nobody_knows(kind: str, lacks: tuple[str, ...]) -> None:
    tool = next(each for each in MOVING if each.kind == kind)
    async with direct(spec_of(lacks=lacks), drive="generic402") as b:
        b.session.cyclic.pairs = object()
        b.session.cyclic.play = _must_not_play
        if kind == "first-power" and "608F" in lacks:
            # Its checklist answers what must be done first.
            result = await begun(tool, b)
            assert isinstance(result, FirstPowerResult)
            assert "resolution_first" in {check.finding for check in result.checks}
        else:
            with pytest.raises(ScaleUnknown):
                await begun(tool, b)
        assert not b.link.device.axis.powered


async def _must_not_play(_trajectories: Any) -> int:
    raise AssertionError("a setpoint went out")


class Played(Exception):
    """The first setpoints of a tool went out."""


@pytest.mark.long(keep=5)
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in REFUSED_ANYWAY])
async def test_another_clients_feed_constant_is_that_of_the_next_motion(kind: str) -> None:
    """10 000 increments to the revolution when the drive was connected, 1 000 at the motion."""
    tool = next(each for each in MOVING if each.kind == kind)
    async with direct(spec_of(), drive="generic402") as b:
        assert (await b.axis.units()).counts_per_rev == 10_000
        b.link.device.write(0x6092, 1, (1_000).to_bytes(4, "little"))
        sent: list[Any] = []

        async def noted(trajectories: Any) -> int:
            sent.extend(trajectories)
            raise Played

        b.session.cyclic.play = noted
        with pytest.raises(Played):
            await begun(tool, b)
    limits = sent[0].envelope
    more = MORE.get(kind, {})
    span = 2 * more.get("travel_limit", TRAVEL_REV) * 1_000
    assert 0 < limits.position_max - limits.position_min <= span * 1.01
    most = more.get("speed_limit", SPEED_RPM)
    assert 0 < limits.speed_max <= 1.01 * most * 1_000 / 60


async def test_scales_that_change_within_a_motion_end_it_before_the_next_power_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Places of before are no places any more: the axis is not enabled by them."""
    # As long after the last look as a motion relies on it.
    monkeypatch.setattr(scaled, "JUST_LOOKED_S", 0.0)
    async with direct(spec_of(), drive="generic402") as b:
        axis = b.axis
        with axis.granted("a measurement of two parts"):
            await axis.require_certain_scales()
            async with enabled(axis, b.session, Mode.CSV):
                pass
            b.link.device.write(0x6091, 1, (5).to_bytes(4, "little"))
            with pytest.raises(ScaleChanged):
                async with enabled(axis, b.session, Mode.CSV):
                    raise AssertionError("it has power")
            with pytest.raises(ScaleChanged):
                await axis.require_certain_scales()
            assert not b.link.device.axis.powered
        with axis.granted("the next one"):
            assert (await axis.require_certain_scales()).counts_per_rev == 2_000
            async with enabled(axis, b.session, Mode.CSV):
                pass


async def test_a_page_that_reads_the_gear_hides_no_change() -> None:
    """The new value is known from a page's table when the tool comes to its next part."""
    async with direct(spec_of(), drive="generic402") as b:
        axis = b.axis
        with axis.granted("a measurement of two parts"):
            await axis.require_certain_scales()
            b.link.device.write(0x6092, 1, (1_000).to_bytes(4, "little"))
            await axis.drive.read("6092:01")
            await axis.units()
            with pytest.raises(ScaleChanged):
                async with enabled(axis, b.session, Mode.CSV):
                    raise AssertionError("it has power")


async def test_small_moves_begin_again_after_another_gear() -> None:
    """1 000 increments were a tenth of a revolution; they are a whole one now."""
    async with direct(spec_of(lacks=("60A9", "60AA")), drive="generic402") as b:
        await small_move(b.axis, b.session, SmallMoveSettings(1_000), silent())
        assert longest_allowed(b.axis) == 10_000
        b.link.device.write(0x6092, 1, (1_000).to_bytes(4, "little"))
        with pytest.raises(OutOfRange) as refused:
            await small_move(b.axis, b.session, SmallMoveSettings(10_000), silent())
        assert refused.value.limit == "1…1000"
        # Nor may the one of before teach the scale of now.
        with pytest.raises(NotAllowed):
            await teaching.confirmed(b.axis, 0.1)
