"""The binary frames of the scope, and the units of traces."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from backend.api.live.scope_blocks import encode_block
from backend.axes.drive.drive import Drive
from backend.axes.scales.units import AxisUnits
from backend.axes.scope.units import axis_scale
from drivers.link import ScopeBlock
from profiles.loader import load_profile
from tests.support.memory_link import MemoryLink

from backend.axes.drive.ports import Port  # isort: skip


def decode(frame: bytes) -> tuple[dict[str, float], np.ndarray, np.ndarray]:
    """Header, times and samples, after the layout in backend/api/live/messages.py."""
    names = [
        "magic",
        "subscription",
        "sequence",
        "dropped",
        "rows",
        "channels",
        "flags",
        "t0",
        "dt",
    ]
    head = dict(zip(names, struct.unpack_from("<IIIIHHIdd", frame), strict=True))
    rows, channels, at = int(head["rows"]), int(head["channels"]), 40
    times = head["t0"] + head["dt"] * np.arange(rows)
    if int(head["flags"]) & 1:
        times, at = np.frombuffer(frame, "<f8", rows, at), at + 8 * rows
    bases = np.zeros(channels)
    if int(head["flags"]) & 2:
        bases, at = np.frombuffer(frame, "<f8", channels, at), at + 8 * channels
    samples = np.frombuffer(frame, "<f4", rows * channels, at).reshape(rows, channels)
    assert len(frame) == at + samples.nbytes
    return head, times, samples.astype(float) + bases


def block(samples: list[list[float]], **more: object) -> ScopeBlock:
    values = np.array(samples, float)
    return ScopeBlock(3, 10.0, 0.25, ("a", "b"), values, **more)  # type: ignore[arg-type]


def test_columns_of_other_streams_are_not_a_number() -> None:
    head, times, samples = decode(encode_block(7, block([[1, 2], [3, 4]], dropped=9), (2, 0), 3, 5))
    assert (head["subscription"], head["sequence"], head["dropped"]) == (7, 3, 9)
    assert int(head["flags"]) == 5 << 8
    assert times.tolist() == [10.0, 10.25]
    assert samples[:, 2].tolist() == [1, 3]
    assert samples[:, 0].tolist() == [2, 4]
    assert np.isnan(samples[:, 1]).all()


def test_every_count_of_a_position_of_many_turns_comes_through() -> None:
    # One count beyond 2^31 has no float32; the drive's position is 32 bits wide.
    counts = 2.0**31 - 1 + np.arange(5)
    values = np.column_stack([counts, np.full(5, -3.5)])
    valid = np.array([True, True, False, True, True])
    _, _, samples = decode(encode_block(1, block(values.tolist(), valid=valid), (0, 1), 2))
    assert samples[valid, 0].tolist() == counts[valid].tolist()
    assert samples[valid, 1].tolist() == [-3.5] * 4
    assert np.isnan(samples[2]).all()


def test_true_times_of_polled_samples() -> None:
    times = np.array([10.0, 10.4])
    _, found, _ = decode(encode_block(1, block([[1, 2], [3, 4]], times_s=times), (0, 1), 2))
    assert found.tolist() == times.tolist()


@pytest.mark.parametrize(
    ("key", "unit", "factor"),
    [
        ("6064:00", "rev", 1 / 65536),
        ("60F4:00", "rev", 1 / 65536),
        ("606C:00", "rpm", 60 / 65536),
        ("6079:00", "", None),
        ("6041:00", "", None),
    ],
)
def test_traces_are_shown_in_the_units_of_the_axis(
    key: str, unit: str, factor: float | None
) -> None:
    profile = load_profile("mms7")
    drive = Drive("x", "X", profile, [Port(MemoryLink({}), 1, profile.links[0])])
    units = AxisUnits(profile.units, 65536.0)
    assert axis_scale(units, drive, drive.parameter(key)) == (
        unit,
        None if factor is None else pytest.approx(factor, rel=1e-12),
    )
