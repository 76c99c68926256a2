"""Reads the YAML of a drive family into a checked, frozen Profile.

A family is a folder ``profiles/<drive>/`` of ``*.yaml`` files. Each file contains a mapping whose
keys are fields of `Profile`; lists of the same field in several files are joined in file-name
order, so that a long parameter list can be one file per chapter. The parsed result is cached next
to the user's other caches, keyed by the content of every file and of the schema.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import platformdirs
import yaml
from pydantic import ValidationError

from profiles.language.standard_help import HELP_FILE, with_standard_help
from profiles.motion.classify import STANDARD_FILE, classified
from profiles.replacing import move_into_place
from profiles.schema import Profile

#: The profile for an otherwise unknown CiA 402 drive.
STANDARD = "generic402"
_HERE = Path(__file__).parent
#: libyaml's loader if PyYAML was built with it; ten times as fast.
_SafeLoader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
#: ValueError: an impossible date or an endless number. RecursionError: deeply nested.
YAML_ERRORS = (yaml.YAMLError, ValueError, RecursionError)


#: Filled in from the motion rules, see `profiles.motion.classify`.
CLASS_FIELDS = frozenset({"motion", "safe_in_motion", "motion_origin", "motion_reason"})


class Refused(NamedTuple):
    """A record that the schema refuses: its place in the file, its key, and pydantic's error."""

    place: str
    label: str
    error: Mapping[str, Any]


class ProfileError(Exception):
    """A profile file is wrong: a code of the catalogue, and facts that state file and place.

    ``refused`` are the records that the schema refuses. Words are generated where it is shown
    (`drivers.texts.profile_errors`).
    """

    def __init__(
        self, code: str, /, *, refused: Sequence[Refused] = (), **params: str | int
    ) -> None:
        super().__init__(code, params)
        self.code = code
        self.params: Mapping[str, str | int] = params
        self.refused = tuple(refused)

    def __str__(self) -> str:
        facts = ", ".join(f"{name}={fact}" for name, fact in self.params.items())
        found = [f"; {at} ({label}): {error['msg']}" for at, label, error in self.refused]
        return f"{self.code} ({facts})" + "".join(found)


def user_folder() -> Path:
    """Return the folder of the user's own and imported profiles; it need not exist."""
    chosen = os.environ.get("SERVODECK_PROFILES")
    return Path(chosen) if chosen else Path(platformdirs.user_data_dir("servodeck")) / "profiles"


def drive_names() -> tuple[str, ...]:
    """Return the names of all families with a folder here or in the user's folder, sorted."""
    folders = (_HERE, user_folder())
    return tuple(sorted({p.parent.name for f in folders for p in f.glob("*/profile.yaml")}))


def load_profile(drive: str) -> Profile:
    """Load one family. A profile of the user's own is reloaded when its files have changed.

    Raises:
        ProfileError: unknown drive, broken YAML, or a record that the schema refuses.
    """
    if drive not in drive_names():
        raise ProfileError("profile.unknown", name=drive, known=", ".join(drive_names()))
    own = is_own(drive)
    files = sorted(((user_folder() if own else _HERE) / drive).glob("*.yaml"))
    return _load(drive, tuple(_Version(p, p.stat().st_mtime_ns if own else 0) for p in files))


def is_own(drive: str) -> bool:
    """Return whether a family is in the user's folder; those of servodeck take precedence."""
    return not (_HERE / drive / "profile.yaml").exists()


class _Version(NamedTuple):
    """A file with its time: an edited profile is a different one for the cache."""

    path: Path
    mtime_ns: int


@cache
def _load(drive: str, versions: tuple[_Version, ...]) -> Profile:
    files = [version.path for version in versions]
    cached = _cache_path(drive, files)
    if (profile := _read_cache(cached)) is not None:
        return profile
    profile = parse_profile({path.name: path.read_text("utf-8") for path in files})
    _write_cache(cached, profile)
    return profile


def load_all() -> dict[str, Profile]:
    """Return all families by name, without broken ones of the user (see `broken_profiles`)."""
    broken = broken_profiles()
    return {name: load_profile(name) for name in drive_names() if name not in broken}


def broken_profiles() -> dict[str, ProfileError]:
    """Return the user's own profiles that cannot be used, and why.

    One error in an edited file must not prevent all other drives from being found.
    """
    found: dict[str, ProfileError] = {}
    for name in filter(is_own, drive_names()):
        try:
            load_profile(name)
        except ProfileError as error:
            found[name] = error
        except OSError as error:
            detail = error.strerror or str(error)
            found[name] = ProfileError(
                "profile.not-readable", file=str(error.filename or name), detail=detail
            )
        except UnicodeDecodeError as error:
            found[name] = ProfileError("profile.not-utf8", name=name, detail=error.reason)
    return found


def parse_profile(texts: dict[str, str]) -> Profile:
    """Join YAML texts (file name to content) and check them.

    Raises:
        ProfileError: with file name and line for broken YAML, with the record for bad data.
    """
    merged: dict[str, Any] = {}
    for name, text in texts.items():
        try:
            data = yaml.load(text, Loader=_SafeLoader)  # noqa: S506 - both loaders are safe
        except YAML_ERRORS as error:
            raise ProfileError("profile.no-yaml", file=name, detail=str(error)) from error
        if not isinstance(data, dict):
            raise ProfileError("profile.no-mapping", file=name)
        for field, value in data.items():
            if isinstance(value, list) and isinstance(merged.get(field), list):
                merged[field] = merged[field] + value
            elif field in merged:
                raise ProfileError("profile.field-twice", file=name, field=str(field))
            else:
                merged[field] = value
    _refuse_own_classes(merged)
    _move_notes(merged)
    try:
        return classified(with_standard_help(Profile.model_validate(merged)))
    except ValidationError as error:
        raise ProfileError(
            "profile.refused",
            name=str(merged.get("drive", "?")),
            errors=error.error_count(),
            refused=_refused(merged, error),
        ) from error


#: Kinds of quirks of version 0.2.0 that no code uses: they are notes now.
_NOTES_ONCE = frozenset({
    "eeprom_on_every_write", "saving_mask", "trigger_bits_manual", "mode_change_pause",
    "no_following_error_bit", "home_found_bit_15", "save_readback_ambiguous", "sdo_pause_on_save",
    "gear_on_init", "brake_by_pdo", "partial_manual", "types_unreliable", "no_watchdog",
    "positive_limit_first",
})  # fmt: skip


def _move_notes(merged: dict[str, Any]) -> None:
    """Convert a profile of the user's own from version 0.2.0 to the present form."""
    quirks, notes = merged.get("quirks"), merged.get("notes") or []
    if not isinstance(quirks, list) or not isinstance(notes, list):
        return
    moved = [q for q in quirks if isinstance(q, dict) and q.get("kind") in _NOTES_ONCE]
    if moved:
        merged["quirks"] = [q for q in quirks if q not in moved]
        merged["notes"] = [
            *notes,
            *({k: q[k] for k in ("key", "help", "source") if k in q} for q in moved),
        ]


def _refuse_own_classes(merged: dict[str, Any]) -> None:
    """Require that motion classes are only in the rules, which state a reason for each.

    Raises:
        ProfileError: the record of a parameter states a class itself.
    """
    rows = merged.get("parameters")
    for row in rows if isinstance(rows, list) else ():
        if isinstance(row, dict) and (given := CLASS_FIELDS & row.keys()):
            raise ProfileError(
                "profile.class-in-row",
                name=str(merged.get("drive", "?")),
                key=str(row.get("key", "?")),
                given=", ".join(sorted(given)),
            )


def _refused(merged: dict[str, Any], error: ValidationError) -> list[Refused]:
    """Return the first errors, each with its place in the file and the key of its record."""
    found: list[Refused] = []
    for item in error.errors()[:20]:
        record: Any = merged
        for step in item["loc"][:2]:
            try:
                record = record[step]
            except (KeyError, IndexError, TypeError):
                break
        label = record.get("key") or record.get("code") or "" if isinstance(record, dict) else ""
        found.append(Refused(".".join(map(str, item["loc"])), str(label), item))
    return found


def _cache_path(drive: str, files: list[Path]) -> Path:
    digest = hashlib.sha256()
    # Whatever shapes a profile: one that an earlier version stored would lack what is new.
    code = (*sorted(_HERE.glob("*.py")), *sorted((_HERE / "motion").glob("*.py")))
    for path in [*code, STANDARD_FILE, HELP_FILE, *files]:
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    folder = Path(os.environ.get("SERVODECK_CACHE") or platformdirs.user_cache_dir("servodeck"))
    return folder / f"profile-{drive}-{digest.hexdigest()[:20]}.pickle"


def _is_foreign(path: Path) -> bool:
    """Return whether somebody else may have written it.

    On Windows only the place decides: the user's own cache folder is trusted, any other is not.
    """
    if sys.platform == "win32":
        return not path.is_relative_to(platformdirs.user_cache_dir("servodeck"))
    return path.stat().st_uid != os.getuid()


def _read_cache(path: Path) -> Profile | None:
    try:
        if _is_foreign(path):  # a pickle from another user must not be trusted
            return None
        loaded = pickle.loads(path.read_bytes())  # noqa: S301 - our own file, owner checked
    except (OSError, AttributeError, EOFError, ImportError, pickle.UnpicklingError):
        return None
    return loaded if isinstance(loaded, Profile) else None


def _write_cache(path: Path, profile: Profile) -> None:
    """Write the cache if possible: a read-only or full disk only costs time."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        for old in path.parent.glob(f"profile-{profile.drive}-*.pickle"):
            old.unlink(missing_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as handle:
            handle.write(pickle.dumps(profile))
        move_into_place(Path(handle.name), path)
    except OSError:
        return
