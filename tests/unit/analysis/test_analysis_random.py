"""A few of the random axes of `benchmarks.analysis_campaign`, held to the table of tuning.md."""

import pytest
from random_axes import errors, missed_modes, played, random_case, result_of


# By the seed's remainder of six: plain, close resonances, hardly damped, vertical with a closed
# loop, a delay of two cycles, a coarse encoder.
@pytest.mark.long
@pytest.mark.parametrize(
    ("seed", "rate"),
    [(24, 1000.0), (25, 1000.0), (2, 4000.0), (27, 1000.0), (10, 1000.0), (23, 1000.0)],
)
def test_a_random_axis_is_measured_within_the_limits(seed, rate):
    case = random_case(seed, rate)
    records = played(case)
    assert records is not None
    found = result_of(case, records)
    assert found.trusted
    high = 1000.0 if rate > 2000 else 200.0 if case.loop_hz else 250.0
    near = errors(found.frf, case.mechanics, 5.0, high)
    assert near.lines > 20
    assert near.magnitude_db < (0.4 if case.loop_hz else 0.3)
    assert near.phase_deg < (3.0 if case.loop_hz or rate > 2000 else 2.0)
    assert near.covered >= 0.9
    assert missed_modes(found, case) == []
