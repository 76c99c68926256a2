"""Stored measurements: anyone can reopen them with the same answer, or gets the reason why not."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from backend.axes.drive.drive import Drive
from backend.records.library import measurements
from backend.records.library.measurements import (
    BadMeasurement,
    MeasurementStore,
    profile_version,
    unpack,
)
from backend.station.evaluation import evaluate
from drivers.errors import DriveError, NotAllowed
from tests.support import measurements as known

SAVED = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)
MADE = {"step": known.step, "speed_loop": known.speed_loop, "inertia": known.inertia}


def _file(drive: Drive, kind: str = "step") -> bytes:
    return known.file_of(drive, MADE[kind](), SAVED)


def test_a_step_that_was_stored_still_has_its_rise_time(drive: Drive) -> None:
    result = evaluate(unpack(_file(drive))).result
    numbers = result["step"]
    assert isinstance(numbers, dict)
    # Sampled once a millisecond and interpolated.
    assert numbers["rise_s"] == pytest.approx(known.RISE_S, abs=2e-4)
    assert numbers["overshoot_percent"] == pytest.approx(0.0, abs=0.01)


def test_a_loop_that_was_stored_still_has_its_bandwidth(drive: Drive) -> None:
    result = evaluate(unpack(_file(drive, "speed_loop"))).result
    margins = result["margins"]
    assert isinstance(margins, dict)
    assert margins["bandwidth_hz"] == pytest.approx(known.bandwidth_hz(), rel=0.02)
    assert margins["stable"] is True


def test_an_inertia_that_was_stored_is_still_the_same(drive: Drive) -> None:
    result = evaluate(unpack(_file(drive, "inertia"))).result
    assert result["inertia_kgm2"] == pytest.approx(known.INERTIA, rel=0.02)
    assert result["coulomb_nm"] == pytest.approx(known.COULOMB, rel=0.1)
    # 2e-4 against a motor of 5e-5.
    assert result["load_ratio"] == pytest.approx(3.0, rel=0.03)


@pytest.mark.parametrize("kind", list(MADE))
def test_what_was_concluded_is_compared(drive: Drive, tmp_path: Path, kind: str) -> None:
    store = MeasurementStore(tmp_path)
    name = store.store("a.sdmeas", _file(drive, kind))
    first = evaluate(store.load(name))
    assert first.agrees is None

    store.conclude(name, first.result)
    again = evaluate(store.load(name))
    assert again.agrees is True
    assert again.result == first.result
    assert store.head(name).saved == SAVED


def test_another_conclusion_is_named(drive: Drive, tmp_path: Path) -> None:
    store = MeasurementStore(tmp_path)
    name = store.store("a.sdmeas", _file(drive))
    result = evaluate(store.load(name)).result
    numbers = result["step"]
    assert isinstance(numbers, dict)
    store.conclude(name, result | {"step": numbers | {"rise_s": 0.5}, "gone": 1})
    again = evaluate(store.load(name))
    assert again.agrees is False
    assert again.differences == ("step.rise_s", "gone")


def test_the_file_tells_who_measured_what(drive: Drive) -> None:
    meta = unpack(_file(drive, "speed_loop")).meta
    assert meta["profile"] == "sample"
    assert meta["profile_version"] == profile_version(drive.profile)
    settings = meta["settings"]
    assert isinstance(settings, dict)
    assert settings["envelope"]["torque_percent"] == known.ENVELOPE.torque_percent
    changed = drive.profile.model_copy(update={"title": "Sample drive, second edition"})
    assert profile_version(changed) != profile_version(drive.profile)


def test_no_damage_is_taken_for_a_measurement(drive: Drive) -> None:
    """A byte changed anywhere is found, or changes nothing; nothing else is ever raised."""
    whole = _file(drive)
    answer = evaluate(unpack(whole)).result
    found = 0
    for place in range(0, len(whole), max(1, len(whole) // 300)):
        data = bytearray(whole)
        data[place] ^= 0x5A
        try:
            # Dates and the like in the archive's directory are not part of the measurement.
            same = evaluate(unpack(bytes(data))).result == answer
        except BadMeasurement:
            found += 1
            continue
        assert same, place
    assert found > 200


@pytest.mark.parametrize("length", [0, 1, 100, 0.5, -1])
def test_a_file_that_was_cut_short(drive: Drive, length: float) -> None:
    whole = _file(drive)
    cut = whole[: int(len(whole) * length)] if isinstance(length, float) else whole[:length]
    with pytest.raises(BadMeasurement, match=r"x\.sdmeas is damaged"):
        unpack(cut, "x.sdmeas")


def _changed(data: bytes, change: Callable[[dict[str, object]], None]) -> bytes:
    """The same file with another head."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        for member in old.namelist():
            content = old.read(member)
            if member == "meta.npy":
                meta = json.loads(np.load(io.BytesIO(content)).tobytes())
                change(meta)
                part = io.BytesIO()
                np.save(part, np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8))
                content = part.getvalue()
            new.writestr(member, content)
    return out.getvalue()


def test_a_newer_version_says_so(drive: Drive) -> None:
    data = _changed(_file(drive), lambda meta: meta.update(version=99))
    with pytest.raises(BadMeasurement, match="newer version"):
        unpack(data)


@pytest.mark.parametrize("field", ["settings", "facts", "sample_rate_hz", "tool"])
@pytest.mark.parametrize("kind", list(MADE))
def test_a_file_without_a_part_says_so(drive: Drive, kind: str, field: str) -> None:
    data = _changed(_file(drive, kind), lambda meta: meta.pop(field))
    with pytest.raises(BadMeasurement):
        evaluate(unpack(data))


def test_a_file_made_to_fill_the_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measurements, "_MAX_UNPACKED", 1_000_000)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for number in range(11):
            archive.writestr(f"{number}.npy", bytes(100_000))
    with pytest.raises(BadMeasurement, match="larger than any measurement"):
        unpack(out.getvalue())


@pytest.mark.parametrize(
    "head",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (35184372088832,), }",  # 256 TiB
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-5,), }",
        "{'descr': '|O', 'fortran_order': False, 'shape': (1,), }",
        "{'descr': '<U4', 'fortran_order': False, 'shape': (1,), }",
        "(" * 900,
    ],
)
def test_a_signal_that_is_made_to_do_harm_is_refused(drive: Drive, head: str) -> None:
    """The head of an array is text that numpy evaluates (NEP 1)."""
    text = head.encode().ljust(((len(head) + 10) // 64 + 1) * 64 - 11) + b"\n"
    array = b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(64)
    data = io.BytesIO(_file(drive))
    with zipfile.ZipFile(data, "a") as archive:
        archive.writestr("more.npy", array)
    with pytest.raises(BadMeasurement):
        unpack(data.getvalue())


def test_a_missing_file_is_no_damage(tmp_path: Path) -> None:
    store = MeasurementStore(tmp_path)
    for ask in (store.load, store.head, store.delete):
        with pytest.raises(NotAllowed, match="there is no measurement"):
            ask("none.sdmeas")
    with pytest.raises(DriveError):
        store.read("../none.sdmeas")
