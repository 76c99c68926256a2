"""When motors of other physics than the tool assumes are too warm, compared with what the tool
says.

Four motors of four bodies each (`tests.support.warm_motor`), whose rated torque and time constant
are measured on them as a maker does, under five cycles. Aims: the moment lies in the stated range,
and whoever is said to endure a cycle does.
"""

from __future__ import annotations

from backend.analysis.duty.heat import heat_of, permitted_rise
from benchmarks._aims import Aim, print_verdict
from tests.support.warm_motor import RATED_RISE_K
from tests.unit.analysis.test_duty import CASES, LOSSES_W, MOTORS, RATED_RPM, machine


def judged() -> tuple[int, int, int]:
    """Print a line for each case; cases in the stated range, not contradicted, and in all."""
    inside = right = cases = 0
    print(
        "motor          peak %   °C    too warm after      stated (min)         rise of permitted"
    )
    for name, motor in MOTORS.items():
        air = motor.calibrated(LOSSES_W)
        tau_s = motor.time_constant_s(LOSSES_W, air)
        for peak, ambient in CASES:
            cycle = machine(16.0, 200.0, peak=peak)
            truth = motor.too_warm_s(
                LOSSES_W, air, cycle.torque_percent / 100.0, cycle.speed_rpm / RATED_RPM, ambient
            )
            permitted = permitted_rise(ambient, RATED_RISE_K)
            assert permitted is not None, "the rise is stated"
            found = heat_of(cycle, RATED_RPM, permitted=permitted, time_constant_s=tau_s)
            earliest, latest = found.trip_s
            low, high = found.rise
            cases += 1
            if truth is None:
                inside += latest is None
            else:
                inside += earliest is not None and earliest <= truth <= (latest or truth)
            right += (high >= 1.0 or truth is None) and (low < 1.0 or truth is not None)
            print(
                f"{name:13} {peak:7.0f} {ambient:4.0f} {_minutes(truth):>17}"
                f" {_minutes(earliest):>10} … {_minutes(latest):6} {low:12.2f} … {high:.2f}"
            )
    return inside, right, cases


def main() -> int:
    """0 where all aims are met."""
    inside, right, cases = judged()
    return not print_verdict(
        [
            Aim(f"in the stated range: {inside} of {cases}", inside == cases),
            Aim(f"verdict not contradicted: {right} of {cases}", right == cases),
        ]
    )


def _minutes(seconds: float | None) -> str:
    return "never" if seconds is None else f"{seconds / 60.0:.1f}"


if __name__ == "__main__":
    raise SystemExit(main())
