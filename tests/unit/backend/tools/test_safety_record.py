"""Traces of safety functions whose times are known exactly, and the signature on a record."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any

import httpx
import numpy as np
import pytest

from backend.api.app import make_app
from backend.report.gather import choose
from backend.station.bench import Bench
from backend.tools.watching.safety_check.evaluate import Trace, evaluate, reevaluate, signed
from backend.tools.watching.safety_check.result import SafetyResult
from backend.tools.watching.safety_check.run import TOOL
from backend.tools.watching.safety_check.settings import SafetySettings

RATE, RPM, AT = 1000.0, 300.0, 1500
ASKED = SafetySettings(travel_limit=60, speed_limit=900, torque_limit=100, speed_rpm=RPM,
                       nothing_hangs=True, device="S1", person="Ann")  # fmt: skip


def trace(
    *, stops_in: int = 200, torque_for: int = 0, state_at: int | None = AT, torque: float = 8.0,
    again_at: int | None = None, power_at_stop: bool = False, noise: float = 0.05,
) -> Trace:  # fmt: skip
    """Times in samples of 1 ms. From ``AT`` on the speed falls in a straight line."""
    n = 4000
    at = np.arange(n)
    commanded = np.where(at >= 500, RPM, 0.0)
    fall = np.clip(1.0 - (at - AT) / stops_in, 0.0, 1.0)
    speed = np.where(at >= 500, RPM, 0.0) * np.where(at < AT, 1.0, fall)
    percent = np.where((at >= 500) & (at < AT + torque_for), torque, 0.0)
    if power_at_stop:
        percent = np.where((at >= AT) & (at < AT + stops_in), -20.0, percent)
    enabled = at >= 300
    if state_at is not None:
        enabled &= at < state_at
    if again_at is not None:
        enabled |= at >= again_at
    rng = np.random.default_rng(3)
    return Trace(
        np.cumsum(speed) / 60.0 / RATE, speed, percent + rng.normal(0, noise, n), commanded,
        enabled, np.zeros(n, np.bool_), np.ones(n, np.bool_), RATE, n,
        "2026-11-25T10:00:00+00:00",
    )  # fmt: skip


def of(function: str, made: Trace, **changed: Any) -> SafetyResult:
    return evaluate(made, ASKED.model_copy(update={"function": function, **changed}))


def test_times_and_ways_of_a_torque_that_goes() -> None:
    """A straight line from 300 rpm in 0.2 s: 0.5 rev."""
    found = of("sto", trace(torque_for=35), torque_free_limit_ms=50.0, stop_limit_rev=0.6)
    assert found.verdict == "within_limits"
    assert found.torque_free_ms == pytest.approx(35.0, abs=3.0)
    assert found.torque_free_ci95_ms is not None
    assert found.torque_free_ci95_ms[0] <= found.torque_free_ms <= found.torque_free_ci95_ms[1]
    assert found.stop_rev == pytest.approx(0.5, rel=0.02)
    assert found.stop_ms == pytest.approx(200.0, rel=0.06)
    late = of("sto", trace(torque_for=35), torque_free_limit_ms=20.0)
    assert (late.verdict, late.exceeded) == ("beyond_limits", ("torque_free",))


@pytest.mark.parametrize(
    ("made", "verdict", "obstacle"),
    [
        (trace(torque_for=4000), "torque_remains", None),
        (trace(stops_in=9000), "still_turning", None),
        (trace(again_at=3000), "restarted", None),
        (trace(torque=0.4), "not_shown", "torque_in_noise"),
        (trace(state_at=None), "not_shown", "stayed_enabled"),
    ],
)
def test_what_is_no_torque_off(made: Trace, verdict: str, obstacle: str | None) -> None:
    found = of("sto", made)
    assert found.verdict == verdict
    if obstacle is not None:
        assert found.obstacle == obstacle


def test_a_controlled_stop_keeps_its_torque_until_it_stands() -> None:
    assert of("ss1", trace(power_at_stop=True)).verdict == "recorded"
    assert of("ss1", trace()).verdict == "power_off_at_speed"
    made = trace()
    quick = np.zeros(4000, np.bool_)
    quick[AT : AT + 5] = True
    cut = Trace(
        *[
            quick if name == "quick_stop" else getattr(made, name)
            for name in Trace.__dataclass_fields__
        ]
    )
    found = of("ss1", cut)
    assert (found.verdict, found.obstacle) == ("not_shown", "quick_stop_cut")


def test_a_limit_switch_that_stops_the_axis_and_one_that_does_not() -> None:
    stopped = of("limit_positive", trace(state_at=None, stops_in=50), stop_limit_ms=80.0)
    assert (stopped.verdict, stopped.sign) == ("within_limits", "speed")
    ignored = of("limit_positive", trace(state_at=None, stops_in=10**9))
    assert ignored.verdict == "not_triggered"
    assert "Nothing happened" in TOOL.text(TOOL.report(ignored).notes[0].name)


@pytest.mark.parametrize(
    "made",
    [
        # The torque that holds the axis at the switch, or one that cannot be distinguished.
        trace(state_at=None, stops_in=50, torque_for=4000),
        trace(state_at=None, stops_in=50, torque=0.2),
    ],
)
def test_a_limit_of_a_torque_that_was_not_seen_to_go_is_not_met(made: Trace) -> None:
    found = of("limit_positive", made, torque_free_limit_ms=50.0, stop_limit_ms=80.0)
    assert (found.verdict, found.torque_free_ms) == ("not_shown", None)
    assert found.stop_ms == pytest.approx(50.0, abs=20.0)


def test_a_limit_of_a_stop_is_not_met_by_an_axis_that_goes_on_at_limited_speed() -> None:
    made = trace(state_at=None, stops_in=10**9)
    made.speed_rpm[:] *= 0.8
    made.commanded_rpm[:AT] *= 0.8
    made.position_rev[:] = np.cumsum(made.speed_rpm) / 60.0 / RATE
    known = {"limited_rpm": 0.9 * RPM}
    assert of("speed_limit", made, **known).verdict == "within_limits"
    found = of("speed_limit", made, **known, stop_limit_ms=100.0)
    assert (found.verdict, found.stop_ms) == ("not_shown", None)


def test_lost_samples_are_no_proof() -> None:
    made = trace()
    made.valid[AT + 3] = False
    assert of("sto", made).obstacle == "samples_lost"


def test_what_the_tool_does_at_its_end_is_none_of_the_function() -> None:
    made = trace(state_at=None, stops_in=50)
    made.torque_percent[3500:] = 60.0
    cut = Trace(
        *[
            3400 if name == "asked_until" else getattr(made, name)
            for name in Trace.__dataclass_fields__
        ]
    )
    found = of("limit_positive", cut)
    assert found.watched_ms == pytest.approx(3400 - AT, abs=60)
    assert max(found.trace_torque_percent) < 20.0


def test_every_report_says_that_it_is_no_certificate() -> None:
    for found in (of("sto", trace()), of("ss1", trace(torque_for=4000))):
        names = [note.name for note in TOOL.report(found).notes]
        assert "no_certificate" in names
        for note in TOOL.report(found).notes:
            assert TOOL.text(note.name, "zh", note.values)


def test_a_signature_holds_what_was_signed() -> None:
    made = trace()
    meta: dict[str, Any] = {
        "tool": "safety-check",
        "settings": ASKED.model_dump(mode="json"),
        **made.facts(),
    }
    when = "2026-11-25T11:00:00+00:00"
    signature = signed(made.arrays(), meta, "Ben", when, "guard 3")
    kept = {**meta, "signature": signature}
    found = reevaluate(made.arrays(), kept)
    assert found.signature is not None
    assert found.signature.intact
    assert found.model_copy(update={"signature": None}) == reevaluate(made.arrays(), meta)
    with pytest.raises(ValueError):  # noqa: PT011 - any reason
        signed(made.arrays(), kept, "Ben", when, "")
    with pytest.raises(ValueError):  # noqa: PT011 - any reason
        signed(made.arrays(), {**meta, "tool": "friction"}, "Ben", when, "")
    arrays = made.arrays()
    arrays["torque_percent"] = np.zeros(4000)
    other = {**ASKED.model_dump(mode="json"), "stop_limit_ms": 9000.0}
    for changed in (
        reevaluate(arrays, kept),
        reevaluate(made.arrays(), {**kept, "settings": other}),
        reevaluate(made.arrays(), {**kept, "signature": {**signature, "person": "Eve"}}),
    ):
        assert changed.signature is not None
        assert not changed.signature.intact
        assert "signature_broken" in [note.name for note in TOOL.report(changed).notes]


def test_the_report_takes_the_newest_record_of_each_function() -> None:
    begun = datetime(2026, 11, 25, tzinfo=UTC)
    heads: dict[str, Any] = {
        f"{function}{hour}": SimpleNamespace(
            kind="safety-check",
            saved=begun + timedelta(hours=hour),
            meta={"settings": {"function": function}},
        )
        for function, hour in (("sto", 1), ("sto", 3), ("ss1", 2))
    }
    assert choose(heads, begun + timedelta(hours=2, minutes=30)) == [("ss12", ""), ("sto3", "")]


async def test_a_stored_record_is_signed_once_and_still_agrees(bench: Bench) -> None:
    made = trace()
    meta = {"tool": "safety-check", "settings": ASKED.model_dump(mode="json"), **made.facts()}
    drive = next(iter(bench.connected_drives.values())).drive
    name = bench.measurements.save("safety-check", drive, made.arrays(), meta)
    first = evaluate(made, ASKED)
    bench.measurements.conclude(name, first.model_dump(mode="json"))
    app = make_app(bench, hosts=frozenset({"test"}))
    transport, path = httpx.ASGITransport(app), f"/measurements/{name}"
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as http:
        nobody = await http.post(f"{path}/signature", json={})
        assert nobody.json()["code"] == "safety-check.signer-needs-name"
        signed_now = await http.post(f"{path}/signature", json={"person": "Ben"})
        assert signed_now.json()["signature"]["intact"]
        again = await http.post(f"{path}/signature", json={"person": "Eve"})
        assert again.json()["code"] == "safety-check.nothing-to-sign"
        kept = (await http.get(path)).json()
    assert kept["agrees"]
    assert kept["result"]["signature"]["person"] == "Ben"
    assert kept["result"]["verdict"] == first.verdict
