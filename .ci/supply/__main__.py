"""What servodeck is built from: locked versions with hashes, a bill of materials, a notice.

    python .ci/supply            make them again (the locks ask a package index)
    python .ci/supply --check    fail where one of them is not what the project says; no network

``run.txt``, ``dev.txt`` and ``build.txt`` next to this file lock the packages of CPython 3.11
to 3.13 on every system, each with the hashes of its files. ``sbom.cdx.json`` (CycloneDX 1.6) and
``NOTICE`` follow from these, from ``webui/package-lock.json`` and from ``licences.json``, which
keeps what the packages say of their licence.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
import tomllib

import materials
from materials import FOLDER, LOCKS, ROOT

SBOM, NOTICE = FOLDER / "sbom.cdx.json", ROOT / "NOTICE"
_PROJECT = ROOT / "pyproject.toml"


def wanted() -> dict[str, list[str]]:
    """By lock the requirements that `pyproject.toml` names."""
    content = tomllib.loads(_PROJECT.read_text("utf-8"))
    project = content["project"]
    run = sorted(project["dependencies"])
    extras = [one for extra in project["optional-dependencies"].values() for one in extra]
    build = sorted(content["build-system"]["requires"])
    # An editable installation without a package index needs what hatchling asks for, too.
    return {
        "run": run,
        "dev": sorted([*run, *extras]),
        "build": sorted([*build, "editables", "pip"]),
    }


def heading(name: str, requirements: list[str]) -> str:
    """What a lock begins with: how it is made, and from what."""
    digest = hashlib.sha256("\n".join(requirements).encode()).hexdigest()
    return (
        f"# Locked for CPython 3.11 to 3.13: make supply-chain makes it anew.\n"
        f"# {name}: sha256 of the requirements in pyproject.toml {digest}\n"
    )


def lock() -> None:
    """Ask the package index for versions and hashes."""
    for name, requirements in wanted().items():
        file = FOLDER / LOCKS[name]
        compiled = subprocess.run(
            [sys.executable, "-m", "uv", "pip", "compile", "--universal", "--generate-hashes",
             "--python-version", "3.11", "--no-header", "--no-annotate", "--quiet",
             "--output-file", str(file), "-"],
            input="\n".join(requirements), text=True, check=False, cwd=ROOT,
            capture_output=True,
        )  # fmt: skip
        if compiled.returncode:
            raise SystemExit(compiled.stderr)
        file.write_text(heading(name, requirements) + without_heading(file.read_text("utf-8")))


def without_heading(text: str) -> str:
    """The lines of a lock that are no comment."""
    return "".join(line for line in text.splitlines(True) if not line.startswith("#"))


def problems() -> list[str]:
    """Everything that is not as it should be."""
    found = []
    for name, requirements in wanted().items():
        file = FOLDER / LOCKS[name]
        text = file.read_text("utf-8") if file.exists() else ""
        if not text.startswith(heading(name, requirements)):
            found.append(f"{file.name} is not of the requirements in pyproject.toml")
        if "://" in text or "--index" in text or "--find-links" in text or "--trusted" in text:
            found.append(f"{file.name} names a place: packages come from where pip is set up")
        found += [f"{file.name}: {each}" for each in materials.wrong_with_lock(text, requirements)]
    if '"resolved"' in materials.PAGE_LOCK.read_text("utf-8"):
        found.append("webui/package-lock.json names a place")
    unknown = materials.unknown_licences()
    if unknown:
        found.append(f"no licence is known of {', '.join(unknown)}")
        return found
    for file, text in ((SBOM, materials.sbom()), (NOTICE, materials.notice())):
        if not file.exists() or file.read_text("utf-8") != text:
            found.append(f"{file.relative_to(ROOT)} is not of these packages")
    return found


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python .ci/supply", description=__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing")
    parser.add_argument("--keep-locks", action="store_true", help="make only the documents anew")
    options = parser.parse_args()
    if not options.check:
        if not options.keep_locks:
            lock()
        materials.learn_licences()
        if not materials.unknown_licences():
            SBOM.write_text(materials.sbom(), "utf-8")
            NOTICE.write_text(materials.notice(), "utf-8")
    found = problems()
    for each in found:
        print(f"{each}: run `make supply-chain`", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
