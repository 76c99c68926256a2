"""Storage of a frequency response: raw data, their evaluation, and the published form."""

from __future__ import annotations

from dataclasses import asdict
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.response.frf import Frf
from backend.analysis.signals import excitation as signals
from backend.analysis.signals.arrays import FloatArray
from backend.axes.axis.axis import Envelope
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.tool import Arrays, Meta
from backend.tools.tuning.sweep.evaluation import (
    LoadSide,
    Records,
    SweepResult,
    SweepSettings,
    evaluate,
)
from backend.tools.tuning.sweep.plan import Setup
from backend.tools.tuning.sweep.result import (
    DetectedInfo,
    DirectResponse,
    LoadResponse,
    ModelInfo,
    ResonanceInfo,
    SweepAnswer,
)
from backend.tools.wire_message import wire_messages, words_of

#: Counts of the second encoder, an array of each realisation.
_LOAD = "load_counts"


def raw_of(
    records: Records, setup: Setup, settings: SweepSettings, *, dc: bool
) -> tuple[dict[str, npt.NDArray[np.generic]], dict[str, object]]:
    """Arrays and facts from which `reevaluated` reproduces the result."""
    arrays: dict[str, npt.NDArray[np.generic]] = {}
    structure = []
    for number, (sequence, recording) in enumerate(records):
        arrays[f"{number}/excitation"] = sequence.excitation.samples
        arrays[f"{number}/lines"] = sequence.excitation.lines
        for name, values in recording.arrays().items():
            arrays[f"{number}/{name}"] = values
        if recording.also is not None:
            arrays[f"{number}/{_LOAD}"] = recording.also[:, 0]
        e = sequence.excitation
        structure.append(
            {
                "kind": e.kind,
                "first_sample": e.first_sample,
                "period_samples": e.period_samples,
                "periods": e.periods,
                "transient_periods": e.transient_periods,
                "base_line": e.base_line,
                "realisation": e.realisation,
                "segments": [asdict(tone) for tone in e.segments],
            }
        )
    return arrays, {
        "tool": "sweep",
        "sample_rate_hz": setup.rate,
        "loop": setup.loop,
        "by_speed": setup.by_speed,
        "integral_hz": setup.integral_hz,
        "dc": dc,
        "facts": asdict(setup.facts),
        "settings": asdict(settings),
        "excitation": structure,
    }


def reevaluate(arrays: Arrays, meta: Meta) -> SweepAnswer:
    """Evaluate stored raw data again, in the published form.

    Raises:
        ValueError: not the raw data of a sweep.
    """
    return answer_of(reevaluated(arrays, meta))


def reevaluated(arrays: Arrays, meta: Meta) -> SweepResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a sweep.
    """
    try:
        return _reevaluated(arrays, meta)
    except (KeyError, TypeError) as error:
        raise ValueError(f"not the raw data of a sweep: {error!r}") from error


def _reevaluated(arrays: Arrays, meta: Meta) -> SweepResult:
    rate = float(str(meta["sample_rate_hz"]))
    given, as_reported, structure = meta["settings"], meta["facts"], meta["excitation"]
    if (
        not isinstance(given, dict)
        or not isinstance(as_reported, dict)
        or not isinstance(structure, list)
    ):
        raise TypeError("settings, facts or excitation")
    settings = SweepSettings(**{**given, "envelope": Envelope(**given["envelope"])})
    records = []
    for number, part in enumerate(structure):
        tones = tuple(signals.Segment(**tone) for tone in part.get("segments", ()))
        plain = {name: value for name, value in part.items() if name != "segments"}
        excitation = signals.Excitation(
            samples=np.asarray(arrays[f"{number}/excitation"], np.float64),
            sample_rate_hz=rate,
            lines=np.asarray(arrays[f"{number}/lines"], np.int64),
            segments=tones,
            **plain,
        )
        columns = {
            name: np.asarray(arrays[f"{number}/{name}"], np.float64)
            for name in ("position_rad", "velocity_rad_s", "torque_nm", "sent", "offset")
        }
        valid = np.asarray(arrays[f"{number}/valid"], np.bool_)
        # Files of older versions, and of drives without a second encoder, do not have it.
        load = arrays.get(f"{number}/{_LOAD}")
        also = None if load is None else np.asarray(load, np.float64)[:, None]
        recording = Recording(rate, **columns, valid=valid, also=also)
        records.append((excite.Sequence(excitation), recording))
    loop = str(meta["loop"])
    closed: Literal["none", "speed", "position"] = (
        "none" if loop == "none" else "position" if loop == "position" else "speed"
    )
    integral = meta.get("integral_hz")
    return evaluate(
        tuple(records), rate, AxisFacts(**as_reported), settings, closed, bool(meta["dc"]),
        bool(meta.get("by_speed", False)), None if integral is None else float(str(integral)),
    )  # fmt: skip


def answer_of(result: SweepResult) -> SweepAnswer:
    """The result in the form that page, report, files and command line use."""
    frf = result.frf
    messages = wire_messages(result.warnings)
    return SweepAnswer(
        kind=result.kind,
        loop=result.loop,
        sample_rate_hz=frf.sample_rate_hz,
        valid_band_hz=frf.valid_band_hz,
        frequency_hz=tuple(frf.frequency_hz.tolist()),
        magnitude_db=tuple(frf.magnitude_db.tolist()),
        phase_deg=tuple(frf.phase_deg.tolist()),
        coherence=tuple(frf.coherence.tolist()),
        std_db=_numbers(frf.std_db),
        std_deg=_numbers(frf.std_deg),
        resonances=tuple(
            ResonanceInfo(
                kind=r.kind,
                frequency_hz=r.frequency_hz,
                damping=r.damping,
                height_db=r.height_db,
                frequency_ci95_hz=r.frequency_ci95_hz,
                damping_ci95=r.damping_ci95,
            )
            for r in result.resonances
        ),
        margins=result.margins,
        unit=result.unit,
        trusted=result.trusted,
        delay_s=result.delay_s,
        motion_s=result.motion_s,
        saturated_share=result.saturated_share,
        current_bandwidth_hz=result.current_bandwidth_hz,
        speed_filter_hz=result.speed_filter_hz,
        coulomb_nm=frf.coulomb_nm,
        noise=_numbers(frf.noise),
        distortion=_numbers(frf.distortion),
        detected=None if result.detected is None else DetectedInfo(**asdict(result.detected)),
        periods_used=frf.periods_used,
        periods_dropped=frf.periods_dropped,
        direct=_direct(result.direct),
        model=None if result.model is None else ModelInfo(**asdict(result.model)),
        load=None if result.load is None else _load(result.load),
        warnings=words_of(messages, "en"),
        warning_messages=messages,
    )


def _direct(frf: Frf) -> DirectResponse:
    return DirectResponse(
        valid_band_hz=frf.valid_band_hz,
        magnitude_db=tuple(frf.magnitude_db.tolist()),
        phase_deg=tuple(frf.phase_deg.tolist()),
        std_db=_numbers(frf.std_db),
        std_deg=_numbers(frf.std_deg),
    )


def _load(load: LoadSide) -> LoadResponse:
    frf = load.frf
    return LoadResponse(
        valid_band_hz=frf.valid_band_hz,
        frequency_hz=tuple(frf.frequency_hz.tolist()),
        magnitude_db=tuple(frf.magnitude_db.tolist()),
        phase_deg=tuple(frf.phase_deg.tolist()),
        coherence=tuple(frf.coherence.tolist()),
        std_db=_numbers(frf.std_db),
        std_deg=_numbers(frf.std_deg),
        counts_per_motor_rev=load.counts_per_motor_rev,
    )


def _numbers(values: FloatArray) -> tuple[float | None, ...]:
    """Values with None for NaN and infinity, which JSON does not have."""
    return tuple(float(v) if np.isfinite(v) else None for v in values)
