"""Recordings as other programs write them: what is read, and what is refused with which reason."""

from __future__ import annotations

import gzip
import io
import json
import os
from datetime import datetime, timedelta

import numpy as np
import pytest
from scipy.io import savemat

from backend.records.response_import.contents import MAX_UNPACKED_BYTES, read_table
from backend.records.response_import.errors import BadRecording
from backend.records.response_import.evaluation import ImportSettings, evaluate_file
from backend.records.response_import.signals import signals_of
from backend.records.response_import.units import scale_of

N = 400
T = np.arange(N) / 1000.0
RNG = np.random.default_rng(1)
U = np.round(RNG.normal(size=N), 4)
Y = np.round(np.cumsum(U) / 50.0, 5)


def text(
    separator: str = ",",
    comma: bool = False,
    head: str = "time_s{s}in{s}out\n",
    time: object = None,
) -> str:
    times = T if time is None else time
    rows = [
        separator.join(f"{v:.6g}" for v in row)
        for row in zip(times, U, Y, strict=True)  # type: ignore[call-overload]
    ]
    body = "\n".join(rows)
    return head.replace("{s}", separator) + (body.replace(".", ",") if comma else body) + "\n"


def read(data: bytes | str, time: str | None = "1", one: str = "2", two: str = "3", **more: object):  # type: ignore[no-untyped-def]
    raw = data.encode() if isinstance(data, str) else data
    return signals_of(
        read_table(raw, "trace.csv"),
        "trace.csv",
        time=time,
        signal_in=one,
        signal_out=two,
        **more,  # type: ignore[arg-type]
    )


def check(found) -> None:  # type: ignore[no-untyped-def]
    assert found.sample_rate_hz == 1000.0
    np.testing.assert_allclose(found.signal_in, U, atol=1e-12)
    np.testing.assert_allclose(found.signal_out, Y, rtol=1e-5, atol=1e-12)


#: TwinCAT Scope View writes pairs of name and value, then one time column for each channel.
TWINCAT = (
    "Name\tYT Scope Project\nFile\tC:\\trace.tcscopex\nStarttime of export\t132514\n"
    "EndTime of export\t132518\n\nName\tTorque\tName\tVelocity\nSymbolComment\t\tSymbolComment\t\n"
    "Data-Type\tREAL64\tData-Type\tREAL64\nSampleTime[ms]\t1\tSampleTime[ms]\t1\n"
    "VariableSize\t8\tVariableSize\t8\nUnit\t\tUnit\t\n\n"
)


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(text(), id="comma"),
        pytest.param(text(";"), id="semicolon"),
        pytest.param(text("\t"), id="tab"),
        pytest.param(text(";", comma=True), id="German Excel"),
        pytest.param(text("\t", comma=True), id="tab, decimal comma"),
        pytest.param(
            "\n".join(
                ",".join(f'"{cell}"' for cell in line.split(";"))
                for line in text(";", comma=True).splitlines()
            ),
            id="decimal comma between quotes",
        ),
        pytest.param(text(head=""), id="no names"),
        pytest.param(text(" ", head="# t u y\n"), id="blanks"),
        pytest.param(text().replace("\n", "\r\n"), id="CRLF"),
        pytest.param("\ufeff" + text(), id="BOM"),
        pytest.param(text(";").encode("utf-16"), id="UTF-16"),
        pytest.param(text(";").encode("utf-16-le"), id="UTF-16 without BOM"),
        pytest.param(
            text(head="Zeit [s],Drehmoment [%],Drehzahl [°/s]\n").encode("latin-1"), id="Latin-1"
        ),
        pytest.param(gzip.compress(text().encode()), id="gzip"),
        pytest.param("Recorder 3\nDate: 2024-01-02\nRate = 1000 Hz\n\n" + text(), id="head lines"),
        pytest.param(text(head="time;in;out\n[s];[A];[rpm]\n".replace(";", ",")), id="units line"),
        pytest.param(text().replace("\n", ",\n"), id="separator at the end"),
    ],
)
def test_text_in_many_forms_is_one_recording(data: str | bytes) -> None:
    check(read(data))


def test_columns_by_name_without_its_unit_and_by_number() -> None:
    data = text(head="Time (ms),Torque [%],Speed [rpm]\n", time=T * 1e3)
    found = read(data, "time", "torque", "Speed [rpm]")
    check(found)
    assert found.time_unit == "ms"


def test_a_twincat_scope_export_has_a_time_for_each_channel() -> None:
    rows = "".join(f"{t:g}\t{u}\t{t:g}\t{y}\n" for t, u, y in zip(T * 1e3, U, Y, strict=True))
    table = read_table((TWINCAT + rows).encode(), "scope.csv")
    assert [n.split(" ")[0] for n in table.names] == ["Time", "Torque", "Time", "Velocity"]
    found = signals_of(table, "scope.csv", time="1", signal_in="Torque", signal_out="Velocity")
    assert found.time_unit == "ms"
    check(found)


#: A newer Scope: seventeen lines in the head, channels of one rate behind one time, a last line.
SCOPE_3 = (
    "Name;bench\nFile;bench.csv\nStarttime of export;1;Monday;15:56:24.376\n\n\n"
    "Name;Torque;Name;Velocity;Position\nSymbolComment;;SymbolComment;;\n"
    "Data-Type;REAL64;Data-Type;REAL64;REAL64\nSampleTime[ms];{fast};SampleTime[ms];1;1\n"
    + "".join(f"{key};0;{key};0;0\n" for key in ("VariableSize", "IndexGroup", "IndexOffset"))
    + "SymbolName;MAIN.x;SymbolName;MAIN.x;MAIN.x\n"
    + "".join(f"{key};0;{key};0;0\n" for key in ("NetID", "Port", "Offset", "ScaleFactor"))
    + "BitMask;0xff;BitMask;0xff;0xff\nUnit;Nm (Torque);Unit;(None);(None)\n"
    "Unit ScaleFactor;1;Unit ScaleFactor;1;1\nUnit Offset;0;Unit Offset;0;0\n\n"
)


def scope_3(times: np.ndarray, fast: str, end: str = "EOF\n") -> bytes:
    rows = [f"{a:g};{u};{b:g};{y};0" for a, u, b, y in zip(times, U, T * 1e3, Y, strict=True)]
    return ("\ufeff" + SCOPE_3.format(fast=fast) + "\n".join(rows) + "\n" + end).encode()


def test_a_newer_scope_export_has_names_far_above_its_table_and_a_last_line() -> None:
    table = read_table(scope_3(T * 1e3, "1"), "scope.csv")
    assert table.names == ("Time [ms]", "Torque [Nm]", "Time [ms]", "Velocity", "Position")
    check(signals_of(table, "scope.csv", time="3", signal_in="Torque", signal_out="Velocity"))


def test_a_scope_export_between_blanks_has_the_names_that_hold_no_blank() -> None:
    data = scope_3(T * 1e3, "1").replace(b"Torque;Name", b"Motor torque;Name").replace(b";", b" ")
    table = read_table(data, "scope.csv")
    assert table.names == ("Time [ms]", "MAIN.x", "Time [ms]", "MAIN.x", "MAIN.x")
    check(signals_of(table, "scope.csv", time="1", signal_in="2", signal_out="4"))


def test_channels_of_a_scope_at_other_times_are_not_one_recording() -> None:
    """Rows of two rates side by side: input and output of a row belong to different moments."""
    table = read_table(scope_3(T * 200.0, "0.2"), "scope.csv")
    for time, rate in (("1", None), ("3", None), (None, 1000.0)):
        with pytest.raises(BadRecording, match="not sampled at the times given") as error:
            signals_of(
                table, "scope.csv", time=time, signal_in="Torque", signal_out="Velocity",
                sample_rate_hz=rate,
            )  # fmt: skip
        assert error.value.remedy


def test_a_column_with_fewer_rows_was_sampled_at_another_rate() -> None:
    rows = [
        f"{t},{u},{Y[i] if i < N * 2 // 3 else ''}"
        for i, (t, u) in enumerate(zip(T, U, strict=True))
    ]
    with pytest.raises(BadRecording, match="different numbers of rows"):
        read("t,in,out\n" + "\n".join(rows))


def codesys(times: np.ndarray, later: float = 0.0) -> bytes:
    text = "[key]; [value]\nVersion; 0x03050000\nName; Trace\n"
    for i, (name, values) in enumerate((("Drive.Torque", U), ("Drive.Speed", Y))):
        text += f"{i}.Variable; {name}\n{i}.Class; 14\n{i}.Data; \n"
        text += "".join(f"; {t:g}; {v}\n" for t, v in zip(times + i * later, values, strict=True))
    return text.encode()


def test_a_codesys_trace_has_its_channels_one_below_the_other() -> None:
    table = read_table(codesys(np.arange(N) + 2.0), "trace.csv")
    assert table.names == ("Time", "Drive.Torque", "Drive.Speed")
    used = {"time": "Time", "signal_in": "Drive.Torque", "signal_out": "Drive.Speed"}
    check(signals_of(table, "trace.csv", **used, time_unit="ms"))
    # The file does not state its unit; seconds would be one sample each.
    with pytest.raises(BadRecording, match="1 Hz") as error:
        signals_of(table, "trace.csv", **used)
    assert error.value.remedy
    apart = read_table(codesys(np.arange(N) + 2.0, 0.5), "trace.csv")
    assert apart.names == ("Time", "Drive.Torque", "Time", "Drive.Speed")
    with pytest.raises(BadRecording, match="not sampled at the times given"):
        signals_of(apart, "trace.csv", **{**used, "time": "1"}, time_unit="ms")
    broken = codesys(np.arange(N) + 2.0).replace(b"; 5; ", b"; 5; x", 1)
    with pytest.raises(BadRecording, match="line 10, column 3"):
        read_table(broken, "trace.csv")


def test_matlab_vectors_structures_and_matrices() -> None:
    for variables in (
        {"t": T, "u": U, "y": Y},
        {"d": {"t": T[:, None], "u": U[:, None], "y": Y[:, None]}},
        {"m": np.column_stack([T, U, Y])},
    ):
        for packed in (False, True):
            out = io.BytesIO()
            savemat(out, variables, do_compression=packed)
            check(read(out.getvalue()))


def test_matlab_arrays_of_structures_cells_and_simulink() -> None:
    channels = np.zeros(2, dtype=[("Name", object), ("Data", object)])
    channels[:] = [("Torque", U), ("Speed", Y)]
    of_block = np.zeros(2, dtype=[("values", object), ("label", object)])
    of_block[:] = [(U[None, None, :], "Torque"), (Y[:, None], "Speed")]
    cells = np.empty(3, dtype=object)
    cells[:] = [T, U, Y]
    for variables in (
        {"X": {"Data": T}, "Y": channels},
        {"out": {"time": T[:, None], "signals": of_block}},
        {"c": cells},
    ):
        out = io.BytesIO()
        savemat(out, variables)
        check(read(out.getvalue()))
    assert read_table(out.getvalue(), "x.mat").names == ("c{1}", "c{2}", "c{3}")


def test_matlab_of_version_4() -> None:
    for variables in ({"t": T, "u": U, "y": Y}, {"m": np.column_stack([T, U, Y])}):
        out = io.BytesIO()
        savemat(out, variables, format="4")
        check(read(out.getvalue()))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "is empty"),
        (b"PK\x03\x04" + b"x" * 90, "Excel workbook"),
        (b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n", "7.3"),
        (b"\x89HDF\r\n\x1a\n", "7.3"),
        (os.urandom(5000) + b"\0", "table of numbers|binary"),
        (b"<html><body>nothing</body></html>", "no table"),
        (b"\x1f\x8b\x08\x00garbage", "gzip"),
        (b"\xff\xfe\x00\xd8\x00", "damaged"),
        (b"MATLAB 5.0 MAT-file".ljust(126) + b"IM" + b"\x0f\0\0\0\xff\0\0\0" + b"x" * 90, "MATLAB"),
    ],
)
def test_what_is_no_recording_is_refused_by_name(data: bytes, said: str) -> None:
    with pytest.raises(BadRecording, match=said) as error:
        read_table(data, "file.csv")
    assert error.value.remedy


@pytest.mark.long
def test_a_gzip_bomb_is_refused_before_it_is_unpacked() -> None:
    bomb = gzip.compress(b"0,0,0\n" * (MAX_UNPACKED_BYTES // 6 + 10), 1)
    assert len(bomb) < MAX_UNPACKED_BYTES // 50
    with pytest.raises(BadRecording, match="unpacks to more"):
        read_table(bomb, "bomb.csv.gz")


def _with(row: int, at: int, value: str) -> str:
    lines = text().splitlines()
    cells = lines[row + 1].split(",")
    cells[at] = value
    lines[row + 1] = ",".join(cells)
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (_with(200, 1, "NaN"), "line 202.*'in' holds no number"),
        (_with(200, 2, ""), "line 202.*'out' holds no number"),
        (_with(200, 0, "0.1"), "line 202.*goes back"),
        (_with(200, 1, "error"), "line 202, column 2: 'error'"),
        ("\n".join(text().splitlines()[:150] + text().splitlines()[170:]), "line 151.*lost"),
        ("\n".join(text().splitlines()[:100]), "samples: 99"),
        (text(time=np.zeros(N)), "does not rise"),
        (text(time=T + np.where(np.arange(N) % 2, 0.0003, 0.0)), "lost, or the clock is not even"),
        (text(time=np.repeat(T[::2], 2)), "stays at"),
        (text(time=T * 1e6), "sample rate.*0.001 Hz"),
        (text().replace("in", "x", 1), "no input column 'in'"),
    ],
)
def test_what_is_wrong_names_column_row_and_remedy(data: str, said: str) -> None:
    with pytest.raises(BadRecording, match=said) as error:
        read(data, "time_s", "in", "out")
    assert error.value.remedy


def test_a_constant_input_and_one_column_for_two_are_refused() -> None:
    flat = "t,u,y\n" + "\n".join(f"{t:g},3.5,{y}" for t, y in zip(T, Y, strict=True))
    with pytest.raises(BadRecording, match="'u' is constant"):
        read(flat)
    with pytest.raises(BadRecording, match="same column"):
        read(text(), "1", "2", "2")
    with pytest.raises(BadRecording, match="as time and as a signal"):
        read(text(), "1", "1", "2")
    with pytest.raises(BadRecording, match="occurs 2 times"):
        read(text(head="t,u,u\n"), "t", "u", "3")


def test_a_signal_too_small_to_compute_with_is_refused_by_its_column() -> None:
    rows = [f"{t:g},{1e-200 * u:.6g},{1e-200 * y:.6g}" for t, u, y in zip(T, U, Y, strict=True)]
    data = ("t,u,y\n" + "\n".join(rows) + "\n").encode()
    settings = ImportSettings(signal_in="u", signal_out="y", time="t")
    with pytest.raises(BadRecording, match="'u' span") as error:
        evaluate_file(data, "trace.csv", settings)
    assert error.value.remedy


def test_a_clock_in_few_digits_keeps_its_rate() -> None:
    rows = text(time=np.round(T, 3) + 0.0)
    check(read(rows))
    coarse = np.floor(np.arange(N) / 2.5) / 1000.0  # 2.5 kHz written in whole milliseconds
    with pytest.raises(BadRecording, match="stays at"):
        read(text(time=coarse))
    found = read(text(time=coarse), None, "2", "3", sample_rate_hz=2500.0)
    assert found.sample_rate_hz == 2500.0


def test_times_that_scatter_are_those_of_an_even_clock() -> None:
    """A recorder that is late by up to a half step writes the samples of an even clock."""
    late = T + np.random.default_rng(2).uniform(0.0, 0.0005, N)
    found = read(text(time=late))
    assert found.sample_rate_hz == pytest.approx(1000.0, rel=1e-4)
    assert found.signal_in.size == N
    # Uniform over half a step: 0.5/sqrt(12).
    assert found.jitter == pytest.approx(0.144, rel=0.1)
    gone = np.delete(np.arange(N), 230)
    lines = text(time=late).splitlines()
    with pytest.raises(BadRecording, match=r"line 23[1-3].*lost"):
        read("\n".join([lines[0], *(lines[1 + i] for i in gone)]))


def test_a_repeated_row_counts_once_and_a_repeated_time_does_not_take_a_sample() -> None:
    lines = text().splitlines()
    check(read("\n".join([*lines[:200], lines[199], *lines[200:]])))
    assert read(_with(200, 0, "0.199")).signal_in.size == N


def test_units_make_nm_and_rad_per_second() -> None:
    scale = scale_of("permille", "rpm", 2.39, None, None)
    assert scale.factor_in == pytest.approx(0.00239)
    assert scale.factor_out == pytest.approx(0.104719755)
    assert scale.unit == "(rad/s)/Nm"
    assert scale_of("A", "rad/s", None, None, None).unit == "(rad/s)/A"
    assert scale_of("A", "rad/s", None, 0.4, None).unit == "(rad/s)/Nm"
    assert scale_of("percent", "rpm", None, None, None).unit == "(rad/s)/rated torque"
    with pytest.raises(BadRecording, match="does not apply to an input in A"):
        scale_of("A", "rad/s", 2.39, None, None)
    with pytest.raises(BadRecording, match="not known"):
        scale_of("furlong", "rad/s", None, None, None)


def _clocked(form: str, begin: datetime, separator: str = ",", digits: int = 3) -> str:
    """The recording with clock texts; ``form`` is that of `strftime`, without the fraction."""
    rows = []
    for i, (u, y) in enumerate(zip(U, Y, strict=True)):
        at = begin + timedelta(milliseconds=i)
        clock = f"{at.strftime(form)}.{at.microsecond:06d}"[: digits - 6 or None]
        rows.append(separator.join((clock, f"{u:.6g}", f"{y:.6g}")))
    return separator.join(("Time [ms]", "in", "out")) + "\n" + "\n".join(rows) + "\n"


NOON = datetime(2026, 11, 28, 12, 0, 59, 700_000)
BEFORE_MIDNIGHT = datetime(2026, 2, 28, 23, 59, 59, 900_000)


@pytest.mark.parametrize(
    "data",
    [
        pytest.param(_clocked("%H:%M:%S", NOON), id="time of day"),
        pytest.param(_clocked("%H:%M:%S", BEFORE_MIDNIGHT, ";"), id="over midnight"),
        pytest.param(_clocked("%Y-%m-%dT%H:%M:%S", BEFORE_MIDNIGHT, "\t", 6), id="ISO 8601"),
        pytest.param(_clocked("%Y-%m-%d %H:%M:%S", BEFORE_MIDNIGHT, " "), id="between blanks"),
        pytest.param(_clocked("%d.%m.%Y %H:%M:%S", BEFORE_MIDNIGHT, ";"), id="day first"),
        pytest.param(
            _clocked("%H:%M:%S", NOON, ";").replace(".", ",").replace("Time", "Zeit"), id="comma"
        ),
        pytest.param(
            "Start: 12:00:00.000\n" + _clocked("%Y-%m-%dT%H:%M:%S", NOON),
            id="a clock in the head",
        ),
    ],
)
def test_clock_texts_are_times(data: str) -> None:
    """ "12:00:01.234" was no number, so the file had no table."""
    found = read(data)
    check(found)
    assert found.time_unit == "s"


def test_a_zone_of_the_clock_may_change_and_the_time_goes_on() -> None:
    lines = _clocked("%Y-%m-%dT%H:%M:%S", datetime(2026, 10, 25, 2, 59, 59, 800_000)).splitlines()
    # At three o'clock the clock goes back by an hour, and its zone says so.
    zoned = [lines[0]]
    for line in lines[1:]:
        clock, rest = line.split(",", 1)
        summer = "T02:" in clock
        zone = "+02:00" if summer else "+01:00"
        zoned.append(f"{clock.replace('T03:', 'T02:')}{zone},{rest}")
    check(read("\n".join(zoned)))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        # The month or the day first: nobody knows.
        (_clocked("%m/%d/%Y %H:%M:%S", NOON, ";"), "no table"),
        (_clocked("%I:%M:%S", NOON, ";").replace(";", " PM;"), "no table|no number"),
        (_clocked("%H:%M:%S", NOON).replace("12:00:59.900", "12:00:59.9x0"), "line 202.*column 1"),
        (_clocked("%H:%M:%S", NOON).replace("12:00:59.900", "2026-02-30 12:00:59.900"), "line 202"),
    ],
)
def test_a_clock_that_can_be_read_in_two_ways_is_refused(data: str, said: str) -> None:
    with pytest.raises(BadRecording, match=said) as error:
        read(data)
    assert error.value.remedy


TIMES, IN, OUT = T.tolist(), U.tolist(), Y.tolist()
ISO = [(NOON + timedelta(milliseconds=i)).isoformat(timespec="milliseconds") for i in range(N)]


@pytest.mark.parametrize(
    "content",
    [
        pytest.param({"in": IN, "out": OUT, "time": TIMES}, id="arrays by name"),
        pytest.param(
            {"meta": {"rate": 1}, "data": {"time": TIMES, "in": IN, "out": OUT}}, id="deeper"
        ),
        pytest.param({"time": ISO, "in": IN, "out": OUT}, id="clock texts"),
        pytest.param(
            [{"time": t, "in": u, "out": y} for t, u, y in zip(TIMES, IN, OUT, strict=True)],
            id="objects",
        ),
        pytest.param(
            [["time", "in", "out"], *map(list, zip(TIMES, IN, OUT, strict=True))], id="rows"
        ),
        pytest.param(
            {"columns": ["time", "in", "out"], "data": list(zip(TIMES, IN, OUT, strict=True))},
            id="table",
        ),
        pytest.param(
            {
                "signals": [
                    {"name": n, "t": TIMES, "values": v} for n, v in (("in", IN), ("out", OUT))
                ]
            },
            id="signals",
        ),
        pytest.param(
            {
                "series": [
                    {"name": n, "data": list(zip(TIMES, v, strict=True))}
                    for n, v in (("in", IN), ("out", OUT))
                ]
            },
            id="pairs",
        ),
        pytest.param(
            {"in": {"time": TIMES, "values": IN}, "out": {"time": TIMES, "values": OUT}},
            id="by signal",
        ),
    ],
)
def test_json_in_many_forms_is_one_recording(content: object) -> None:
    table = read_table(json.dumps(content).encode(), "trace.json")
    assert (table.form, set(table.names)) == ("JSON", {"time", "in", "out"})
    check(read(json.dumps(content), "time", "in", "out"))
    check(read(b"\xef\xbb\xbf" + json.dumps(content, indent=1).encode(), "time", "in", "out"))


def test_json_signals_with_other_times_are_not_one_recording() -> None:
    later = [t + 0.0005 for t in TIMES]
    signals = [{"name": "in", "t": TIMES, "y": IN}, {"name": "out", "t": later, "y": OUT}]
    with pytest.raises(BadRecording, match=r"other times|sampled at"):
        read(json.dumps(signals), "1", "in", "out")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ('{"time": [0, 1', "damaged JSON: line 1"),
        ("[" * 100_000, "nested|damaged JSON"),
        ('{"a": "b"}', "no arrays of numbers"),
        ('{"a": [1, 2]}', "no arrays of numbers"),
        ('{"time": [0, 1], "in": [1, "x"]}', "'in', entry 2: 'x' is no number"),
        ('{"time": [0, 1], "in": [1, {"v": 2}]}', "'in', entry 2"),
        ('{"time": [0, 1], "in": [1, 1' + "0" * 400 + "]}", "'in', entry 2"),
    ],
)
def test_json_that_is_no_recording_is_refused_with_its_place(data: str, said: str) -> None:
    with pytest.raises(BadRecording, match=said) as error:
        read_table(data.encode(), "trace.json")
    assert error.value.remedy


def test_a_head_in_brackets_is_no_json() -> None:
    check(read("[Header]\nstate=1\n[Data]\n" + text()))
