"""Runs every benchmark and prints its table.

    python -m benchmarks [NAME …]

A benchmark is a module of this package with a ``main()`` that prints what it measured and the
figure it aims at. They are no tests: a slow machine gives worse figures, not a failure. That each
runs to its end is tested in its smallest form (`tests/benchmarks`).
"""

from __future__ import annotations

import importlib
import pkgutil
import sys
import time

import benchmarks


def main() -> int:
    """Run the named benchmarks, or all; the exit code counts those that broke."""
    known = [
        m.name for m in pkgutil.iter_modules(benchmarks.__path__) if not m.name.startswith("_")
    ]
    broken = 0
    for name in sys.argv[1:] or known:
        module = importlib.import_module(f"benchmarks.{name}")
        if not hasattr(module, "main"):
            continue
        print(f"== {name}: {(module.__doc__ or '').strip().splitlines()[0]}", flush=True)
        began = time.monotonic()
        argv, sys.argv = sys.argv, [name]
        try:
            module.main()
        except (Exception, SystemExit) as error:
            # A benchmark that ends the program (bad arguments) must not end those after it.
            broken += 1
            print(f"broken: {type(error).__name__}: {error}")
        finally:
            sys.argv = argv
        print(f"== {name}: {time.monotonic() - began:.0f} s\n", flush=True)
    return broken


if __name__ == "__main__":
    raise SystemExit(main())
