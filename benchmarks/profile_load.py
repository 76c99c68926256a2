"""Load time of all profiles: parsed from YAML, and from the cache as a server starts with it.

Aim: below 0.3 s with the cache (issue 5). Each figure is the best of several runs in a process of
its own, so that nothing is warm but the disk; importing Python and pydantic is not counted.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile

_RUNS = 5
_AIM_S = 0.3
_LOAD = """
import json, time
from profiles.loader import load_all
start = time.perf_counter()
profiles = load_all()
spent = time.perf_counter() - start
print(json.dumps([spent, len(profiles), sum(len(p.parameters) for p in profiles.values())]))
"""


def _load(cache: str) -> tuple[float, int, int]:
    done = subprocess.run(
        [sys.executable, "-c", _LOAD],
        env=os.environ | {"SERVODECK_CACHE": cache},
        capture_output=True,
        text=True,
        check=True,
    )
    spent, profiles, parameters = json.loads(done.stdout)
    return float(spent), int(profiles), int(parameters)


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as cache:
        first, profiles, parameters = _load(cache)
        cached = [_load(cache)[0] for _ in range(_RUNS)]
    best, middle = min(cached), statistics.median(cached)
    print(f"{profiles} profiles, {parameters} parameters")
    print(f"parsed and checked   {first:6.2f} s   (once after an update)")
    print(f"from the cache       {best:6.3f} s   (median {middle:.3f} s, aim below {_AIM_S} s)")


if __name__ == "__main__":
    main()
