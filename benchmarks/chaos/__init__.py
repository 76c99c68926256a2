"""Trouble in combinations that nobody thought of, and a judge who asks the drives past the wire.

    python -m benchmarks.chaos [--seconds 120] [--seed N] [--on BUS|mixed|all]

A server in its own process, virtual drives on real wires (``mixed``: MLink, CANopen and Modbus RTU
at once), several people who do random legal and illegal things at once, and random trouble
meanwhile: cables, frames, supplies, mute and slow drives, faults, stopped and killed processes,
dead sockets, a full disk, a clock that jumps. The run is cut into episodes; each ends in quiet,
with all trouble healed and everybody gone, and is judged then and all along (docs/safety.md,
"What is tried against it"). The schedule depends on the seed only; what the processes make of it
does not.
"""

from __future__ import annotations


def main() -> int:
    """Run the trial; the exit status shows whether something was violated."""
    # Not at the top: the server under trial sets its clock before it imports the product.
    from benchmarks.chaos.run import main as run

    return run()
