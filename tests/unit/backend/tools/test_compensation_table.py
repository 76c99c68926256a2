"""The file of ``servodeck friction --table``, and what is printed of it."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import pytest

from backend.axes.axis.axis import Axis
from backend.commands.measuring.friction import _here, _lines
from backend.tools.mechanics.friction.result import FrictionResult

NOTHING = FrictionResult.model_validate(
    {
        "rated_torque_nm": None, "points": (), "curve_speed_rpm": (), "curve_percent": (),
        "coulomb_percent": None, "viscous_percent_per_rpm": None, "stribeck_percent": None,
        "stribeck_speed_rpm": None, "load_percent": None, "harmonics": (),
        "ripple_speed_rpm": 5.0, "ripple_angle_deg": (90.0, 270.0),
        "ripple_forward_percent": (0.6, None), "ripple_backward_percent": (0.4, -0.4),
        "findings": (), "motion_s": 1.0,
    }
)  # fmt: skip
RIPPLE = NOTHING.model_copy(update={"compensation_percent": (0.5, -0.5)})
AXIS = cast(Axis, None)


@pytest.mark.parametrize("asked", [True, False])
async def test_the_table_is_written_where_it_is_asked_for(tmp_path: Path, asked: bool) -> None:
    file = tmp_path / "table.csv"
    given = {"table": file if asked else None}
    await _here(AXIS, RIPPLE, given)
    assert file.exists() is asked
    assert len(_lines(RIPPLE, given)) == asked
    if asked:
        assert file.read_text("utf-8").splitlines() == [
            "position_rev,torque_percent,forward_percent,backward_percent",
            "0.250000,0.500000,0.600000,0.400000",
            "0.750000,-0.500000,,-0.400000",
        ]


async def test_without_a_ripple_no_file_is_written_and_the_reason_is_printed(
    tmp_path: Path,
) -> None:
    given = {"table": tmp_path / "table.csv"}
    await _here(AXIS, NOTHING, given)
    assert not given["table"].exists()
    (line,) = _lines(NOTHING, given)
    assert "no ripple was found" in line
