"""``servodeck response import``: a frequency response from a recording of another program."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from backend.commands.printing import print_text
from backend.commands.session import reported
from backend.store.files import write_atomically
from drivers.errors import NotAllowed
from drivers.texts import limits

app = typer.Typer(
    help="Frequency responses from recordings of other programs. Nothing moves.",
    no_args_is_help=True,
)


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
    from backend.response_import.preview import preview

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
    from backend.response_import.evaluation import ImportSettings, evaluate_file

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
    from backend.response_import.contents import MAX_FILE_BYTES

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
            f"{row['kind']:14} {row['frequency_hz']:8.2f} Hz  ({low:.2f} … {high:.2f})  damping "
            f"{row['damping']:.4f}"
        )
    axis = answer["axis"]
    if isinstance(axis, dict) and axis["verdict"] == "sound":
        low, high = axis["inertia_ci95"]
        lines.append(
            f"inertia {axis['inertia']:.4g} ({low:.4g} … {high:.4g}) {axis['inertia_unit']}  "
            f"viscous friction at this level {axis['viscous']:.3g} {axis['viscous_unit']}"
        )
        lines += [_candidate(row) for row in axis["candidates"]]
    notes = answer["warnings"]
    return lines + [f"note: {w}" for w in (notes if isinstance(notes, list) else [])]


def _candidate(row: dict[str, object]) -> str:
    gains, notches, marks = row["gains"], row["notches"], row["marks"]
    assert isinstance(gains, dict)
    assert isinstance(notches, list | tuple)
    assert isinstance(marks, list | tuple)
    shown = ", ".join(f"{n['center_hz']:.1f} Hz {n['depth_db']:.0f} dB" for n in notches)
    return (
        f"{'/'.join(marks):20} gain {gains['speed_nms']:.4g} per rad/s, integral "
        f"{gains['integral_hz']:.3g} Hz, notches: {shown or 'none'}"
    )


def _method(answer: dict[str, object], said: dict[str, object]) -> str:
    band = answer["valid_band_hz"]
    assert isinstance(band, list)
    low, high = float(band[0]), float(band[1])
    if said["method"] == "periods":
        how = (
            f"periodic excitation, period {said['period_s']:.6g} s: {answer['periods_used']} "
            f"periods used, {said['transient_periods']} left out as transient"
        )
    else:
        how = f"excitation: {said['excitation']}; local polynomial method"
    return f"{how}; {low:.4g} … {high:.4g} Hz in {answer['unit']}"
