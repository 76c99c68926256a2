"""``servodeck response import``: a frequency response from a recording of another program."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.base.printing import print_text, words_of
from backend.commands.base.session import reported
from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed
from drivers.texts import limits
from drivers.texts.message import Text, language, text

app = typer.Typer(
    help="Frequency responses from recordings of other programs. Nothing moves.",
    no_args_is_help=True,
)

_KINDS = {
    "resonance": text("health.resonance"),
    "antiresonance": text("health.antiresonance"),
}
_MARKS = {
    "robust": text("printed.mark-robust"),
    "balanced": text("printed.mark-balanced"),
    "fast": text("printed.mark-fast"),
}
_EXCITATIONS = {
    "chirp": text("printed.by-chirp"),
    "noise": text("printed.by-noise"),
}


class StructureName(StrEnum):
    """Relation of input and output to the axis."""

    unknown = "unknown"
    motor_speed = "motor_speed"
    load_speed = "load_speed"
    speed_loop = "speed_loop"


class TimeUnit(StrEnum):
    """Unit of the time column."""

    s = "s"
    ms = "ms"
    us = "us"
    ns = "ns"


@app.callback()
def _response() -> None:
    """Frequency responses from recordings of other programs. Nothing moves."""


@app.command("columns")
def columns(
    file: Annotated[Path, typer.Argument(metavar="FILE")],
    as_json: Annotated[bool, typer.Option("--json", help="for scripts")] = False,
) -> None:
    """List a recording's columns by number and name, with their first values and ranges."""
    from backend.records.response_import.preview import preview

    with reported():
        found = preview(_bytes(file), file.name)
    if as_json:
        print(json.dumps(found, indent=1))
        return
    print_text("printed.form-and-rows", form=str(found["form"]), rows=str(found["rows"]))
    rows = found["columns"]
    for row in rows if isinstance(rows, list) else []:
        print(f"{row['number']:3}  {row['name']:32}  {row['low']:>12.6g} … {row['high']:<12.6g}")


@app.command("import")
def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="CSV (also .gz), or MAT up to v7")],
    input_: Annotated[str, typer.Option("--input", help="column of torque, current or reference")],
    output: Annotated[str, typer.Option(help="column of the motion")],
    out: Annotated[Path, typer.Option(help="JSON file to write, as of sweep --out")],
    time: Annotated[str | None, typer.Option(help="column of the time; name or number")] = None,
    time_unit: Annotated[
        TimeUnit | None, typer.Option(help="else by the column's name, else seconds")
    ] = None,
    sample_rate: Annotated[float | None, typer.Option(help="Hz; instead of a time column")] = None,
    input_unit: Annotated[
        str, typer.Option(help="Nm, mNm, A, mA, rated, percent, permille, rad/s, rpm or 1")
    ] = "1",
    output_unit: Annotated[
        str, typer.Option(help="rad/s, rpm, rev/s, deg/s, m/s, rad, rev, deg or 1")
    ] = "1",
    unit: Annotated[
        str | None, typer.Option(help="unit of the response as a text; else from both units")
    ] = None,
    rated_torque: Annotated[
        float | None, typer.Option(help="Nm, where the input is a share of it")
    ] = None,
    torque_constant: Annotated[
        float | None, typer.Option(help="Nm per A, where the input is a current")
    ] = None,
    structure: Annotated[
        StructureName,
        typer.Option(
            help="motor_speed: torque to the speed of the same shaft; allows inertia, "
            "notches and gains"
        ),
    ] = StructureName.unknown,
    f_min: Annotated[float | None, typer.Option(help="Hz; lowest line")] = None,
    f_max: Annotated[float | None, typer.Option(help="Hz; highest line")] = None,
    output_filter: Annotated[
        float | None, typer.Option(help="Hz; first-order low-pass of the recorded output")
    ] = None,
    current_bandwidth: Annotated[
        float | None, typer.Option(help="Hz; of the drive's current loop, for gains")
    ] = None,
    loop_delay: Annotated[
        float | None, typer.Option(help="s; delay of the drive's speed loop, for gains")
    ] = None,
) -> None:
    """Evaluate a recording of another program: response, band, modes. Nothing moves.

    The excitation (periodic, chirp or noise) is found in the input. The band, ±1.96 std, is where
    another run of the same machine puts each line.
    """
    from backend.records.response_import.evaluation import ImportSettings, evaluate_file

    low, high = f_min if f_min is not None else 0.0, f_max if f_max is not None else 1e9
    settings = ImportSettings(
        time=time, signal_in=input_, signal_out=output,
        time_unit=time_unit.value if time_unit is not None else None, sample_rate_hz=sample_rate,
        input_unit=input_unit, output_unit=output_unit, unit=unit, rated_torque_nm=rated_torque,
        torque_constant_nm_a=torque_constant, structure=structure.value,
        band_hz=None if f_min is None and f_max is None else (low, high),
        output_filter_hz=output_filter, current_bandwidth_hz=current_bandwidth,
        loop_delay_s=loop_delay,
    )  # fmt: skip
    with reported():
        answer = evaluate_file(_bytes(file), file.name, settings)
        write_atomically(out, json.dumps(answer, indent=1).encode())
    for line in _reported(answer):
        print(line)
    print_text("printed.written", file=str(out))


def _bytes(file: Path) -> bytes:
    from backend.records.response_import.contents import MAX_FILE_BYTES

    size = file.stat().st_size
    if size > MAX_FILE_BYTES:
        raise NotAllowed(
            "command.bytes", value=size, limit=limits.size(MAX_FILE_BYTES), file=file.name
        )
    return file.read_bytes()


def _reported(answer: dict[str, object]) -> list[str]:
    said = answer["imported"]
    assert isinstance(said, dict)
    lines = [_method(answer, said)]
    rows = answer["resonances"]
    for row in rows if isinstance(rows, list) else []:
        low, high = row["frequency_ci95_hz"]
        lines.append(
            words_of(
                "printed.response-mode",
                mode=f"{_KINDS[row['kind']].words(language()):14}",
                frequency=f"{row['frequency_hz']:8.2f}",
                low=f"{low:.2f}",
                high=f"{high:.2f}",
                damping=f"{row['damping']:.4f}",
            )
        )
    axis = answer["axis"]
    if isinstance(axis, dict) and axis["verdict"] == "sound":
        low, high = axis["inertia_ci95"]
        lines.append(
            words_of(
                "printed.response-inertia",
                inertia=f"{axis['inertia']:.4g}",
                low=f"{low:.4g}",
                high=f"{high:.4g}",
                unit=str(axis["inertia_unit"]),
                viscous=f"{axis['viscous']:.3g}",
                viscous_unit=str(axis["viscous_unit"]),
            )
        )
        lines += [_candidate(row) for row in axis["candidates"]]
    notes = answer["warning_messages"]
    return lines + [
        words_of("printed.note", words=Text.from_wire(each))
        for each in (notes if isinstance(notes, list) else [])
    ]


def _candidate(row: dict[str, object]) -> str:
    gains, notches, marks = row["gains"], row["notches"], row["marks"]
    assert isinstance(gains, dict)
    assert isinstance(notches, list | tuple)
    assert isinstance(marks, list | tuple)
    shown = ", ".join(f"{n['center_hz']:.1f} Hz {n['depth_db']:.0f} dB" for n in notches)
    return words_of(
        "printed.response-candidate",
        marks=f"{'/'.join(_MARKS[mark].words(language()) for mark in marks):20}",
        gain=f"{gains['speed_nms']:.4g}",
        integral=f"{gains['integral_hz']:.3g}",
        notches=shown or words_of("printed.no-notches"),
    )


def _method(answer: dict[str, object], said: dict[str, object]) -> str:
    band = answer["valid_band_hz"]
    assert isinstance(band, list)
    low, high = float(band[0]), float(band[1])
    if said["method"] == "periods":
        how = words_of(
            "printed.by-periods",
            period=f"{said['period_s']:.6g}",
            used=str(answer["periods_used"]),
            left=str(said["transient_periods"]),
        )
    else:
        how = _EXCITATIONS[str(said["excitation"])].words(language())
    return words_of(
        "printed.response-method",
        how=how,
        low=f"{low:.4g}",
        high=f"{high:.4g}",
        unit=str(answer["unit"]),
    )
