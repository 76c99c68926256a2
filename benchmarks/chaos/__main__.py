"""Entry point of ``python -m benchmarks.chaos``."""

from __future__ import annotations

from benchmarks.chaos.run import main

if __name__ == "__main__":
    raise SystemExit(main())
