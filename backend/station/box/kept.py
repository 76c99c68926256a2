"""Name and roles of the ports, kept in ``box.json`` in the state folder.

Read whenever they are asked for: the terminal may change them while the server runs.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from backend.store.files import write_atomically
from drivers.errors import NotAllowed

FILE = "box.json"


@dataclass(frozen=True, slots=True)
class Box:
    """``name`` as in the network, ``ethercat`` and ``office`` names of ports; empty for none."""

    name: str
    ethercat: str = ""
    office: str = ""


def read(folder: Path) -> Box | None:
    """What was set up; None where nothing was.

    Raises:
        NotAllowed: the file cannot be read. Then it is not known which port is the office's.
    """
    file = folder / FILE
    try:
        said = json.loads(file.read_text("utf-8"))
        found = Box(said["name"], said["ethercat"], said["office"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise NotAllowed("station.box-file-damaged", value=str(file), cause=str(error)) from error
    if not all(isinstance(value, str) for value in (found.name, found.ethercat, found.office)):
        raise NotAllowed("station.box-file-damaged", value=str(file), cause=repr(said))
    return found


def keep(folder: Path, box: Box) -> None:
    """Keep it in place of the one before, also of one that cannot be read.

    Raises:
        StorageFailed: it cannot be written; the one before stays.
    """
    write_atomically(folder / FILE, json.dumps(asdict(box)).encode())


def names_of(box: Box | None) -> frozenset[str]:
    """Names under which a browser may come: the plain one, and that of mDNS (RFC 6762)."""
    return frozenset({box.name, f"{box.name}.local"}) if box else frozenset()
