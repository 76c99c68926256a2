"""The packages of the locks, their licences, and the documents that follow from them."""

from __future__ import annotations

import base64
import functools
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / ".ci" / "supply"
LOCKS = {"run": "run.txt", "dev": "dev.txt", "build": "build.txt"}
LICENCES = FOLDER / "licences.json"
PAGE_LOCK = ROOT / "webui" / "package-lock.json"
_MODULES = ROOT / "webui" / "node_modules"
_PINNED = re.compile(r"^([A-Za-z0-9._-]+)==(\S+?)(?:\s*;\s*(.*?))?\s*\\?$")
_HASH = re.compile(r"--hash=sha256:[0-9a-f]{64}")
_LICENCE_FILES = re.compile(r"(licen[cs]e|copying|notice)(\.|-|$)", re.IGNORECASE)

#: Files in the repository that others have written.
VENDORED = (
    ("DejaVu fonts 2.37", "Bitstream-Vera", "backend/report/render/fonts/LICENSE-DejaVu.txt"),
    ("Droid Sans Fallback (Android 6.0.1), © 2006-2010 Google Corp.", "Apache-2.0", "LICENSE"),
)
#: What classifiers and free texts of packages mean, where they give no expression.
_CLASSIFIERS = {
    "MIT License": "MIT", "MIT": "MIT", "Apache Software License": "Apache-2.0",
    "Apache 2.0": "Apache-2.0", "Apache License 2.0": "Apache-2.0", "BSD License": "BSD-3-Clause",
    "Apache License, Version 2.0": "Apache-2.0", "BSD": "BSD-3-Clause", "ISC": "ISC",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0", "ISC License (ISCL)": "ISC",
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL-3.0-only",
    "GNU Lesser General Public License v3 or later (LGPLv3+)": "LGPL-3.0-or-later",
    "Python Software Foundation License": "PSF-2.0", "The Unlicense (Unlicense)": "Unlicense",
    "GNU General Public License v2 (GPLv2)": "GPL-2.0-only",
}  # fmt: skip


#: What a package says that says nothing; only what is for development may.
UNSTATED = "not stated by the package"


@dataclass(frozen=True, slots=True, order=True)
class Package:
    """One locked package. ``use``: run (installed with servodeck), page (in its page), dev."""

    kind: str
    name: str
    version: str
    use: str
    integrity: str = ""

    @property
    def purl(self) -> str:
        """Package URL (purl-spec)."""
        return f"pkg:{self.kind}/{self.name.replace('@', '%40')}@{self.version}"


def pinned(text: str) -> list[tuple[str, str]]:
    """Names and versions in a lock."""
    found = (_PINNED.match(line) for line in text.splitlines())
    return [(canonicalize_name(each[1]), each[2]) for each in found if each]


def wrong_with_lock(text: str, requirements: Iterable[str]) -> list[str]:
    """What speaks against a lock: a requirement that it does not meet, a package without hash."""
    versions: dict[str, list[str]] = {}
    for name, version in pinned(text):
        versions.setdefault(name, []).append(version)
    wrong = []
    for each in map(Requirement, requirements):
        have = versions.get(canonicalize_name(each.name), [])
        if not have or not all(each.specifier.contains(one, prereleases=True) for one in have):
            wrong.append(f"{each} is not locked")
    for entry in re.split(r"\n(?=[A-Za-z0-9])", text):
        if "==" in entry and not _HASH.search(entry):
            wrong.append(f"{entry.split()[0]} has no hash")
    return wrong


def packages() -> list[Package]:
    """All packages, each once, with the nearest use."""
    found: dict[tuple[str, str, str], Package] = {}
    for use in ("run", "build", "dev"):
        for name, version in pinned((FOLDER / LOCKS[use]).read_text("utf-8")):
            made = Package("pypi", name, version, "run" if use == "run" else "dev")
            found.setdefault(("pypi", name, version), made)
    content = json.loads(PAGE_LOCK.read_text("utf-8"))
    for path, entry in content["packages"].items():
        if not path:
            continue
        name, version = path.rpartition("node_modules/")[2], entry["version"]
        use = "dev" if entry.get("dev") or entry.get("peer") else "page"
        made = Package("npm", name, version, use, entry.get("integrity", ""))
        known = found.get(("npm", name, version))
        if known is None or known.use == "dev":
            found["npm", name, version] = made
    return sorted(found.values())


# --- licences -------------------------------------------------------------------------


@functools.cache
def licences() -> dict[str, str]:
    """What is known, by package URL without a version."""
    if not LICENCES.exists():
        return {}
    known: dict[str, str] = json.loads(LICENCES.read_text("utf-8"))
    return known


def _key(package: Package) -> str:
    return package.purl.rpartition("@")[0]


def unknown_licences() -> list[str]:
    """Packages whose licence nobody has said."""
    known = licences()
    return sorted(
        {
            _key(each)
            for each in packages()
            if known.get(_key(each), UNSTATED) == UNSTATED
            and (each.use != "dev" or _key(each) not in known)
        }
    )


def learn_licences() -> None:
    """Take in what installed packages and the page's lock say; what is not here is kept."""
    known = dict(licences())
    page = json.loads(PAGE_LOCK.read_text("utf-8"))["packages"]
    said = {path.rpartition("node_modules/")[2]: one.get("license") for path, one in page.items()}
    missing = []
    for package in packages():
        name = said.get(package.name) if package.kind == "npm" else _installed(package.name)
        if name:
            known[_key(package)] = name
        elif _key(package) not in known and package.kind == "pypi":
            missing.append(package)
    known |= _fetched(missing)
    kept = {_key(package): known[_key(package)] for package in packages() if _key(package) in known}
    LICENCES.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n", "utf-8")
    licences.cache_clear()


def _fetched(missing: list[Package]) -> dict[str, str]:
    """Of packages that are for other systems or uses, and so not installed here."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for package in missing:
            subprocess.run(
                [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", folder,
                 "--no-compile", f"{package.name}=={package.version}"],
                check=False,
            )  # fmt: skip
        for one in metadata.distributions(path=[folder]):
            key = f"pkg:pypi/{canonicalize_name(one.metadata['Name'])}"
            found[key] = _said(one.metadata)
    return {key: name for key, name in found.items() if name}


def _installed(name: str) -> str:
    try:
        return _said(metadata.metadata(name))
    except metadata.PackageNotFoundError:
        return ""


def _said(metadata_of: metadata.PackageMetadata) -> str:
    about = metadata_of.json
    if expression := about.get("license_expression"):
        return str(expression)
    classified = [
        line.rpartition(" :: ")[2]
        for line in about.get("classifier") or []
        if line.startswith("License :: ") and not line.endswith("OSI Approved")
    ]
    free = str(about.get("license") or "").strip()
    for text in (free, *classified):
        if text in _CLASSIFIERS:
            return _CLASSIFIERS[text]
        if text and "\n" not in text and _expression(text):
            return text
    if classified:
        return " AND ".join(classified)
    return free.splitlines()[0][:80] if free else UNSTATED


def _expression(text: str) -> bool:
    try:
        canonicalize_license_expression(text)
    except InvalidLicenseExpression:
        return False
    return True


# --- documents ------------------------------------------------------------------------


def sbom() -> str:
    """The bill of materials (CycloneDX 1.6, ECMA-424), the same for the same packages."""
    project = {
        "type": "application",
        "bom-ref": "servodeck",
        "name": "servodeck",
        "licenses": [{"license": {"id": "Apache-2.0"}}],
    }
    content: dict[str, Any] = {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": project},
        "components": [_component(package) for package in packages()],
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _component(package: Package) -> dict[str, Any]:
    group, _, name = package.name.rpartition("/")
    licence = licences()[_key(package)]
    component: dict[str, Any] = {
        "type": "library",
        "bom-ref": package.purl,
        **({"group": group} if group else {}),
        "name": name,
        "version": package.version,
        "scope": "excluded" if package.use == "dev" else "required",
        "licenses": (
            [{"expression": licence}] if _expression(licence) else [{"license": {"name": licence}}]
        ),
        "purl": package.purl,
    }
    algorithm, _, digest = package.integrity.partition("-")
    if algorithm == "sha512":
        content = base64.b64decode(digest).hex()
        component["hashes"] = [{"alg": "SHA-512", "content": content}]
    return component


def notice() -> str:
    """Whose work is in servodeck or is installed with it; licence texts of what is in its page."""
    used = [package for package in packages() if package.use != "dev"]
    python = [package for package in used if package.kind == "pypi"]
    page = [package for package in used if package.kind == "npm"]
    parts = [
        "servodeck\n\nThis product is under the Apache License 2.0 (see LICENSE). The following is "
        "the work of others.\nMade by `make supply-chain`; do not edit.\n",
        "Files in this product\n"
        + "".join(f"- {what}: {licence}, see {where}\n" for what, licence, where in VENDORED),
        "Packages that are installed with it; each brings its licence text\n" + _lines(python),
        "Packages that its page contains\n" + _lines(page),
        *(_licence_text(package) for package in page),
    ]
    return "\n".join(parts)


def _lines(some: list[Package]) -> str:
    return "".join(f"- {each.name} {each.version}: {licences()[_key(each)]}\n" for each in some)


def _licence_text(package: Package) -> str:
    folder = _MODULES / package.name
    files = sorted(file for file in folder.glob("*") if _LICENCE_FILES.match(file.name))
    texts = [file.read_text("utf-8").strip().replace("\r\n", "\n") for file in files]
    rule = "-" * 72
    return f"{rule}\n{package.name} {package.version}\n\n" + "\n\n".join(texts) + "\n"
