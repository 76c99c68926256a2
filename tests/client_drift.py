"""Checks that the page's client was generated from the interface as it is now.

    python tests/client_drift.py [--write]

``--write`` stores the interface description; the client is then generated from it by
``npm run generate`` in ``webui/``.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from pydantic.json_schema import models_json_schema

from backend.api.app import make_app
from backend.api.station import models as models_bench
from backend.api.station import models_description, models_doctor
from backend.station.bench import Bench

ROOT = Path(__file__).resolve().parents[1]
DESCRIPTION = ROOT / "webui" / "openapi.json"
CLIENT = ROOT / "webui" / "src" / "api" / "schema.d.ts"


def description() -> str:
    """OpenAPI document, with the models that the results of jobs carry among its schemas."""
    with tempfile.TemporaryDirectory() as folder:
        app = make_app(Bench(Path(folder)), hosts=frozenset())
        document = app.openapi()
    # Carried in the results of jobs, so no route names them.
    results = [
        (model, "serialization")
        for model in (
            models_bench.FoundDrive,
            models_description.ImportedDescription,
            models_description.LineSearchResult,
            models_doctor.TrialResult,
        )
    ]
    _, extra = models_json_schema(results, ref_template="#/components/schemas/{model}")
    schemas = document["components"]["schemas"]
    schemas.update({k: v for k, v in extra["$defs"].items() if k not in schemas})
    document["info"]["version"] = "1"
    return json.dumps(document, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def main() -> int:
    """Compare or write; exit code 1 when something drifted."""
    now = description()
    if "--write" in sys.argv:
        DESCRIPTION.write_text(now, "utf-8")
        return 0
    if DESCRIPTION.read_text("utf-8") != now:
        print(
            "webui/openapi.json is old: run `python tests/client_drift.py --write`, "
            "then `npm run generate` in webui/"
        )
        return 1
    package = json.loads((ROOT / "webui" / "package.json").read_text("utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        fresh = Path(folder) / "schema.d.ts"
        command = package["scripts"]["generate"].replace("src/api/schema.d.ts", str(fresh)).split()
        subprocess.run(
            [sys.executable, str(ROOT / "hatch_build.py"), "exec", "--offline", "--", *command],
            cwd=ROOT / "webui",
            check=True,
            stdout=subprocess.DEVNULL,
        )
        if fresh.read_text("utf-8") != CLIENT.read_text("utf-8"):
            print("webui/src/api/schema.d.ts is old: run `npm run generate` in webui/")
            return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
