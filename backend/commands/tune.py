"""``servodeck autotune``: from an unknown axis to a verified one, without the page."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Annotated

import typer

from backend.axis.axis import Envelope
from backend.commands.measure import (
    Answer,
    AxisName,
    Consent,
    Cycle,
    LoopName,
    Out,
    Profile,
    Rated,
    Speed,
    Station,
    Torque,
    Travel,
    Url,
    Where,
    exchanging,
    show,
)
from backend.commands.options import Json, Server
from backend.commands.remote import remote
from backend.commands.session import progress, run_in_order


class SchemeName(StrEnum):
    """How the axis may travel."""

    free = "free"
    limited = "limited"
    taught = "taught"


class MarkName(StrEnum):
    """How fast the design shall be that is wanted."""

    robust = "robust"
    balanced = "balanced"
    fast = "fast"


class LoadName(StrEnum):
    """What the axis drives."""

    stiff = "stiff"
    medium = "medium"
    compliant = "compliant"


def autotune(
    url: Url = None,
    station: Station = 1,
    profile: Profile = None,
    server: Server = None,
    axis: AxisName = None,
    mark: Annotated[MarkName, typer.Option(help="the design to apply")] = MarkName.balanced,
    load: Annotated[
        LoadName | None, typer.Option(help="judged from the response if not said")
    ] = None,
    apply: Annotated[
        bool, typer.Option("--apply", help="write the design, verify it, and take it back")
    ] = False,
    keep: Annotated[
        bool,
        typer.Option(
            "--keep", help="as --apply, but leave it in force; `servodeck params save` stores it"
        ),
    ] = False,
    loop: Annotated[LoopName, typer.Option(help="closed meanwhile")] = LoopName.auto,
    scheme: SchemeName = SchemeName.free,
    end_low_rev: Annotated[float | None, typer.Option(help="taught end")] = None,
    end_high_rev: Annotated[float | None, typer.Option(help="taught end")] = None,
    cycle_ms: Cycle = 1.0,
    travel_rev: Travel = 3.0,
    speed_rpm: Speed = 1200.0,
    torque_percent: Torque = 80.0,
    rated_torque_nm: Rated = None,
    motor_inertia_kgm2: Annotated[float | None, typer.Option(help="of the motor alone")] = None,
    consent: Consent = False,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Measure, design and, with --apply or --keep, verify an axis's loop gains. The axis moves."""
    ends = _taught_ends(end_low_rev, end_high_rev)
    writes = apply or keep
    request: dict[str, object] = {
        "travel_limit": travel_rev, "speed_limit": speed_rpm, "torque_limit": torque_percent,
        "time_limit_s": 60.0, "consent": consent, "mark": mark.value,
        "load": load.value if load else None, "loop": loop.value, "scheme": scheme.value,
        "ends_rev": ends, "apply": writes, "rated_torque_nm": rated_torque_nm,
        "motor_inertia_kgm2": motor_inertia_kgm2, "cycle_ms": cycle_ms,
    }  # fmt: skip

    async def here() -> Answer:
        # The analysis takes seconds to import; no other command shall wait for it.
        from backend.tools.autotune import run as tool
        from backend.tools.autotune.apply import take_back

        envelope = Envelope(travel_rev, speed_rpm, torque_percent, 60.0)
        settings = tool.AutotuneSettings(
            envelope, mark.value, load.value if load else None, loop.value, scheme.value, ends,
            writes, rated_torque_nm, motor_inertia_kgm2,
        )  # fmt: skip
        async with exchanging(url, station, profile, cycle_ms, envelope, consent) as (at, session):
            found = await tool.autotune(at, session, settings, progress())
            if not keep:
                await take_back(at, found.before)
            return tool.as_json(found)

    where = Where(url, station, profile, server, axis)

    async def there(address: str) -> Answer:
        async with remote(address) as at:
            drive = await where.drive(at)
            found = await at.result(f"/drives/{drive.id}/jobs/autotune", request)
            if not keep and found["before"]:
                body = {"before": found["before"]}
                await at.raw("POST", f"/drives/{drive.id}/tune/undo", body=body)
            return found

    async def work() -> None:
        address = where.asked
        answer = await (here() if address is None else there(address))
        show(answer, out, lambda found: reported(found, kept=keep), as_json=as_json)

    run_in_order(work)


def reported(answer: Answer, *, kept: bool) -> list[str]:
    """The marked designs, what became of the chosen one, and what it does without."""
    lines = [_HEAD, *(_row(each) for each in _maps(answer["candidates"]) if each["marks"])]
    verified, applied = answer["verified"], answer["applied"]
    if isinstance(verified, dict) and isinstance(applied, dict):
        lines += ["", *_verified(applied, verified)]
        changed = answer["before"]
        count = len(changed) if isinstance(changed, dict) else 0
        if not count:
            lines.append("nothing was written: what the axis had is kept")
        elif kept:
            lines.append(
                f"in force: {count} parameters were changed; they are not stored in the drive yet"
            )
        else:
            lines.append("taken back: all parameters are as before")
    else:
        lines += ["", "nothing was written; --apply verifies a design, --keep leaves it in force"]
    for name, word in (("tried", "not kept"), ("notes", "note")):
        texts = answer[name]
        lines += [f"{word}: {text}" for text in (texts if isinstance(texts, list) else [])]
    return lines


_HEAD = (
    "design     speed loop  bandwidth  phase margin  gain margin    Ms   settling  overshoot  "
    "notches"
)


def _row(each: Answer) -> str:
    goals, gains = _map(each["promised"]), _map(each["gains"])
    notches = [f"{_number(n['center_hz'], '.0f')} Hz" for n in _maps(each["notches"])]
    settling = each["settling_s"]
    marks = each["marks"]
    names = ",".join(map(str, marks)) if isinstance(marks, list | tuple) else ""
    return (
        f"{names:9}  {_number(gains['speed_bandwidth_hz'], '7.1f')} Hz  "
        f"{_number(each['bandwidth_hz'], '6.1f')} Hz  "
        f"{_number(goals['phase_margin_deg'], '11.1f')}°  "
        f"{_number(goals['gain_margin_db'], '8.1f')} dB  {_number(goals['ms'], '.2f')}  "
        f"{_number(settling * 1e3 if isinstance(settling, float) else None, '6.1f')} ms  "
        f"{_number(each['overshoot_percent'], '7.0f')} %  {', '.join(notches) or 'none'}"
    )


def _verified(applied: Answer, verified: Answer) -> list[str]:
    goals = _map(applied["promised"])
    verdict = _map(verified.get("verdict"))
    margins = _map(verdict.get("stated")) or _map(_map(verified["sweep"])["margins"])
    rows = (
        ("bandwidth", verified["predicted_bandwidth_hz"], verified["measured_bandwidth_hz"], "Hz"),
        ("phase margin, at least", goals["phase_margin_deg"], margins.get("phase_margin_deg"), "°"),
        ("gain margin, at least", goals["gain_margin_db"], margins.get("gain_margin_db"), "dB"),
        ("Ms, at most", goals["ms"], margins.get("ms"), ""),
    )
    head = f"{'':24}{'predicted':>10}{'verified':>10}"
    return (
        [head]
        + [
            f"{name:24}{_number(promise, '10.2f'):>10}{_number(found, '10.2f'):>10} {unit}".rstrip()
            for name, promise, found, unit in rows
        ]
        + _bands(verdict)
    )


#: How far a verdict reaches.
_COVERAGE = {
    "measured": "all crossovers lie within the measured band",
    "gain_steps": "above the measured band bounded by a raised gain",
    "predicted": "above the measured band predicted only",
}


def _bands(verdict: Answer) -> list[str]:
    """The margins of each band with their intervals, and which of them are predictions."""
    lines = []
    for name in ("measured", "predicted"):
        band = _map(verdict.get(name))
        if not band:
            continue
        phase, gain = _interval(band["phase_margin_deg"], 0), _interval(band["gain_margin_db"], 1)
        peak = _interval(band["peak_sensitivity"], 2)
        lines.append(
            f"{name} {_number(band['low_hz'], '.0f')} to {_number(band['high_hz'], '.0f')} Hz: "
            f"phase margin {phase}°, gain margin {gain} dB, largest |S| {peak}"
        )
    coverage = verdict.get("coverage")
    if isinstance(coverage, str):
        lines.append(_COVERAGE[coverage])
    return lines


def _interval(value: object, digits: int) -> str:
    """A value with the ends of its 95 % interval."""
    found = _map(value)
    if not found:
        return "–"
    ends = [_number(found[name], f".{digits}f").strip() for name in ("value", "low", "high")]
    return f"{ends[0]} ({ends[1]} to {ends[2]})"


def _number(value: object, form: str) -> str:
    width = int(form.split(".", maxsplit=1)[0] or 0)
    return format(value, form) if isinstance(value, float | int) else "–".rjust(width)


def _map(value: object) -> Answer:
    return value if isinstance(value, dict) else {}


def _maps(value: object) -> Iterable[Answer]:
    return [each for each in value if isinstance(each, dict)] if isinstance(value, list) else []


def _taught_ends(low_rev: float | None, high_rev: float | None) -> tuple[float, float] | None:
    """Both ends, or none of them.

    Raises:
        typer.BadParameter: only one is given.
    """
    if low_rev is None or high_rev is None:
        if low_rev is not None or high_rev is not None:
            raise typer.BadParameter("give both --end-low-rev and --end-high-rev, or none of them")
        return None
    return low_rev, high_rev
