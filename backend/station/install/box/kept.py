"""Name and port roles of the station, stored in ``box.json`` in the state folder.

Read at every use, as a command in a terminal may change them while the server runs.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from backend.foundation.store.files import write_atomically
from drivers.errors import NotAllowed

FILE = "box.json"


@dataclass(frozen=True, slots=True)
class Box:
    """Settings of the box: network ``name``, and names of the ports; empty for no port."""

    name: str
    ethercat: str = ""
    office: str = ""


def read(folder: Path) -> Box | None:
    """The stored settings; None where nothing was set up.

    Raises:
        NotAllowed: the file cannot be read, so that the office port is not known.
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
    """Store the settings in place of the earlier ones, also where those cannot be read.

    Raises:
        StorageFailed: the file cannot be written; the earlier one stays.
    """
    write_atomically(folder / FILE, json.dumps(asdict(box)).encode())


def names_of(box: Box | None) -> frozenset[str]:
    """Host names under which browsers may reach the box: the plain and the mDNS name (RFC 6762)."""
    return frozenset({box.name, f"{box.name}.local"}) if box else frozenset()
