"""Evaluation of an imported table with a person's settings, in the JSON form of a sweep."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from backend.analysis.loop.design import design
from backend.analysis.loop.loop_goals import LoadClass
from backend.analysis.loop.loop_structure import DriveLoops
from backend.analysis.loop.measured_plant import measured_plant
from backend.analysis.response.foreign_recordings.collocated import (
    Contradiction,
    RigidPart,
    as_frf,
    contradiction,
    mechanical_model,
    path_delay_s,
    rigid_part,
)
from backend.analysis.response.foreign_recordings.foreign import (
    ForeignResponse,
    NoResponse,
    evaluate,
)
from backend.analysis.signals.arrays import FloatArray
from backend.records.response_import.contents import Table, read_table
from backend.records.response_import.errors import BadRecording
from backend.records.response_import.signals import Signals, signals_of
from backend.records.response_import.units import Scale, scale_of
from drivers.texts import limits
from drivers.texts.answers import sentences
from drivers.texts.message import Text, text

Structure = Literal["unknown", "motor_speed", "load_speed", "speed_loop"]
#: Limits between a compliant, medium and stiff load [Hz], as for servodeck's own measurements.
_COMPLIANT_HZ, _MEDIUM_HZ = 80.0, 300.0
_CLIPPED = 0.01
#: Scatter of the recorded times above which a warning is given, as a share of a step.
_UNEVEN = 0.05


@dataclass(frozen=True)
class ImportSettings:
    """A person's settings for a recording.

    ``structure``: *motor_speed*: torque or current to the speed of the same shaft, the only one
    that permits inertia, notches and gains; *load_speed*: to the speed behind the coupling;
    *speed_loop*: speed reference to speed. ``output_filter_hz``: corner frequency of a first-order
    low-pass in the recorded output. ``current_bandwidth_hz``, ``loop_delay_s``: those of the drive,
    for gains.
    """

    time: str | None
    signal_in: str
    signal_out: str
    time_unit: str | None = None
    sample_rate_hz: float | None = None
    input_unit: str = "1"
    output_unit: str = "1"
    unit: str | None = None
    rated_torque_nm: float | None = None
    torque_constant_nm_a: float | None = None
    structure: Structure = "unknown"
    band_hz: tuple[float, float] | None = None
    output_filter_hz: float | None = None
    current_bandwidth_hz: float | None = None
    loop_delay_s: float | None = None


def evaluate_file(data: bytes, name: str, settings: ImportSettings) -> dict[str, object]:
    """Evaluate the bytes of a file.

    Raises:
        BadRecording: the file or the settings are not usable.
    """
    return evaluate_signals(prepared(read_table(data, name), name, settings), name, settings)


def prepared(table: Table, name: str, settings: ImportSettings) -> Signals:
    """Input and output of a table, checked, in the units of the file."""
    return signals_of(
        table,
        name,
        time=settings.time,
        signal_in=settings.signal_in,
        signal_out=settings.signal_out,
        time_unit=settings.time_unit,
        sample_rate_hz=settings.sample_rate_hz,
    )


def evaluate_signals(signals: Signals, name: str, settings: ImportSettings) -> dict[str, object]:
    """Result in the JSON form of a sweep, with additional data of the import.

    Raises:
        BadRecording: the recording does not permit a result.
    """
    scale = scale_of(
        settings.input_unit,
        settings.output_unit,
        settings.rated_torque_nm,
        settings.torque_constant_nm_a,
        settings.unit,
    )
    _check(settings, scale)
    try:
        found = evaluate(
            scale.factor_in * signals.signal_in,
            scale.factor_out * signals.signal_out,
            signals.sample_rate_hz,
            settings.band_hz,
        )
    except NoResponse as error:
        raise _reported(error, name, signals) from error
    return _as_json(found, signals, settings, scale)


def _check(settings: ImportSettings, scale: Scale) -> None:
    if settings.structure == "motor_speed" and not scale.speed:
        raise BadRecording(
            "import.structure-motor-speed-needs",
            parameter="output-unit",
            value=settings.output_unit,
            limit="rad/s, rpm, rev/s, deg/s",
        )
    for what, value in (
        ("output-filter", settings.output_filter_hz),
        ("current-bandwidth", settings.current_bandwidth_hz),
    ):
        if value is not None and not 0.1 <= value <= 1e5:
            raise BadRecording(
                "import.hz",
                parameter=what,
                value=value,
                limit=limits.between(0.1, 100e3, "Hz"),
                what=text("import.value", name=what),
            )
    if settings.loop_delay_s is not None and not 0.0 <= settings.loop_delay_s <= 0.1:
        raise BadRecording(
            "import.loop-delay",
            parameter="loop-delay",
            value=settings.loop_delay_s,
            limit=limits.between(0.0, 0.1, "s"),
        )
    low, high = settings.band_hz or (1.0, 2.0)
    if not 0.0 <= low < high:
        raise BadRecording(
            "import.band-hz",
            parameter="band",
            value=low,
            limit=limits.below(high, "Hz"),
            high_hz=high,
        )


def _reported(error: NoResponse, name: str, signals: Signals) -> BadRecording:
    """The error for each reason that the analysis reports."""
    facts = error.facts
    if error.code == "few-lines":
        return BadRecording(
            "import.input-excites-frequencies",
            parameter=signals.input_name,
            value=facts["lines"],
            limit=f"{facts['least']:.0f}",
            name=name,
            facts=facts["lines"],
        )
    if error.code == "incoherent":
        return BadRecording(
            "import.not-follow-coherence",
            parameter=signals.output_name,
            value=facts["coherence"],
            limit="0.5",
            name=name,
            input_name=signals.input_name,
            facts=facts["coherence"],
        )
    if error.code == "too-short":
        return BadRecording(
            "import.samples",
            value=facts["samples"],
            limit=limits.at_least(round(facts["least"])),
            name=name,
            facts=facts["samples"],
        )
    of_input = error.code in ("input-constant", "input-span")
    column = signals.input_name if of_input else signals.output_name
    if error.code in ("input-span", "output-span"):
        return BadRecording(
            "import.column-span",
            parameter=column,
            value=facts["value"],
            limit=f"{facts['least']:g} … {facts['most']:g}",
            name=name,
            least=facts["least"],
            most=facts["most"],
        )
    return BadRecording("import.column-constant", parameter=column, value=facts["value"], name=name)


def _as_json(
    found: ForeignResponse, signals: Signals, settings: ImportSettings, scale: Scale
) -> dict[str, object]:
    axis = _axis(found, signals, settings, scale)
    model = found.fit.model if found.fit is not None else None
    return {
        "kind": "speed_loop" if settings.structure == "speed_loop" else "mechanics",
        "loop": "unknown",
        "sample_rate_hz": signals.sample_rate_hz,
        "valid_band_hz": list(found.valid_band_hz),
        "frequency_hz": found.frequency_hz.tolist(),
        "magnitude_db": found.magnitude_db.tolist(),
        "phase_deg": found.phase_deg.tolist(),
        "coherence": found.coherence.tolist(),
        "std_db": _numbers(found.std_db),
        "std_deg": _numbers(found.std_deg),
        "resonances": [asdict(mode.row) for mode in found.modes],
        "margins": {},
        "unit": scale.unit,
        "trusted": found.fit is not None,
        "delay_s": model.delay_s if model is not None else None,
        "motion_s": signals.signal_in.size / signals.sample_rate_hz,
        "saturated_share": 0.0,
        "noise": _numbers(found.noise),
        "distortion": _numbers(found.distortion),
        "periods_used": found.periods_used,
        "periods_dropped": found.transient_periods,
        "imported": {
            "excitation": found.excitation,
            "method": found.method,
            "period_s": found.period_s,
            "transient_periods": found.transient_periods,
            "samples": int(signals.signal_in.size),
            "input": signals.input_name,
            "output": signals.output_name,
            "input_unit": settings.input_unit,
            "output_unit": settings.output_unit,
            "structure": settings.structure,
            "time_unit": signals.time_unit,
            "repeated_rows": signals.repeated_rows,
            "time_jitter": signals.jitter,
            "band_means": "another run of the same machine, 0.7 to 2 times the level",
            "empty_even": found.empty[0],
            "empty_odd": found.empty[1],
            "real_poles_hz": sorted(model.poles_hz) if model is not None else [],
        },
        "axis": axis,
        **sentences("warnings", _warnings(found, axis, signals), "warning"),
    }


def _axis(
    found: ForeignResponse, signals: Signals, settings: ImportSettings, scale: Scale
) -> dict[str, object] | None:
    """Inertia, friction, notches and gains; only where the structure is stated."""
    if settings.structure != "motor_speed" or found.fit is None:
        return None
    delay = path_delay_s(found.fit.model, settings.output_filter_hz)
    wrong = contradiction(found, settings.output_filter_hz, delay)
    if wrong is not None:
        return {"verdict": "not-collocated", "contradiction": asdict(wrong)}
    rigid = rigid_part(found, settings.output_filter_hz)
    if rigid is None:
        return {"verdict": "no-rigid-part"}
    unit = _input_kind(scale)
    answer: dict[str, object] = {
        "verdict": "sound",
        "inertia": rigid.inertia,
        "inertia_ci95": list(rigid.inertia_ci95),
        "inertia_unit": "kg·m²" if scale.torque else f"{unit}·s²/rad",
        "viscous": rigid.viscous,
        "viscous_unit": f"{unit}·s/rad",
        "candidates": [],
    }
    answer["candidates"] = _candidates(found, signals, settings, rigid)
    return answer


def _input_kind(scale: Scale) -> str:
    return "Nm" if scale.torque else scale.unit.rpartition(")/")[2] or "1"


def _candidates(
    found: ForeignResponse, signals: Signals, settings: ImportSettings, rigid: RigidPart
) -> list[dict[str, object]]:
    """Notches and gains for a PI speed loop, gains in units of the input per rad/s."""
    model = mechanical_model(found, settings.output_filter_hz)
    if model is None or found.fit is None or settings.current_bandwidth_hz is None:
        return []
    if settings.loop_delay_s is None:
        return []
    delay = path_delay_s(found.fit.model, settings.output_filter_hz)
    frf = as_frf(found, settings.output_filter_hz, delay, signals.sample_rate_hz)
    loops = DriveLoops(
        settings.current_bandwidth_hz,
        settings.loop_delay_s,
        highest_speed_bandwidth_hz=0.25 * found.valid_band_hz[1],
    )
    table = design(measured_plant(frf, model), rigid.inertia, loops, _load(found), slots=2)
    return [asdict(row) for row in table if row.marks]


def _load(found: ForeignResponse) -> LoadClass:
    first = min(
        (m.row.frequency_hz for m in found.modes if m.row.kind == "antiresonance"), default=np.inf
    )
    if first < _COMPLIANT_HZ:
        return "compliant"
    return "medium" if first < _MEDIUM_HZ else "stiff"


def _warnings(
    found: ForeignResponse, axis: dict[str, object] | None, signals: Signals
) -> list[Text]:
    said = []
    if signals.jitter > _UNEVEN:
        said.append(text("import.times-scatter", share=signals.jitter))
    if found.excitation != "periodic":
        said.append(text("import.not-periodic"))
    elif found.periods_used < 4:
        said.append(text("import.few-periods", periods=found.periods_used))
    if found.clipped_share > _CLIPPED:
        said.append(text("import.input-clipped", share=found.clipped_share))
    if axis is not None and isinstance(wrong := axis.get("contradiction"), dict):
        said.append(_refuted(Contradiction(**wrong)))
    if axis is not None and axis.get("verdict") == "no-rigid-part":
        said.append(text("import.no-rigid-part"))
    if found.fit is None:
        said.append(text("import.no-model"))
    return said


def _refuted(wrong: Contradiction) -> Text:
    facts = {"phase_deg": wrong.phase_deg, "frequency_hz": wrong.frequency_hz}
    if wrong.filter_hz is None:
        return text("import.not-collocated", **facts)
    return text("import.not-collocated-or-filtered", **facts, filter_hz=wrong.filter_hz)


def _numbers(values: FloatArray) -> list[float | None]:
    """Values as a list with None for NaN and infinity, which JSON does not have."""
    return [float(v) if np.isfinite(v) else None for v in values]
