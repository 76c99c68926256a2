"""A measurement of one station is opened on another that shares the library; on both databases."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from backend.foundation.store.blobs import BlobFailed, Blobs
from backend.foundation.store.database import Store
from backend.records.library import Library
from backend.records.library.described import folders
from backend.records.library.entries import Addition, Entry, Query
from backend.records.library.index import Index
from backend.records.library.measurements import MeasurementStore
from backend.records.library.sharing import fetch, share
from drivers.errors import NotAllowed

NAME = "20261121-101500-sweep-X.sdmeas"


def measurement(drive: str = "X", samples: int = 200_000) -> bytes:
    meta = {
        "version": 1,
        "saved": "2026-11-21T10:15:00+00:00",
        "kind": "sweep",
        "drive": drive,
        "profile": "mms7",
        "identity": {"serial": 7},
    }
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, values in (
            ("meta", np.frombuffer(json.dumps(meta).encode(), np.uint8)),
            ("velocity", np.random.default_rng(1).normal(size=samples)),
        ):
            part = io.BytesIO()
            np.save(part, values)
            archive.writestr(f"{name}.npy", part.getvalue())
    return out.getvalue()


class Hall:
    """A station: its folder, and its view of the library that all share."""

    def __init__(self, name: str, store: Store, folder: Path, blobs: Path) -> None:
        self.library = Library(store, Blobs(str(blobs)), lambda _fact: None)
        self.index = Index(store, name, folders(folder))
        self.measurements = MeasurementStore(folder / "measurements")
        self.name = name

    def entry(self, station: str) -> Entry:
        self.index.refresh()
        entries, _ = self.library.search(Query(kinds=("measurement",)))
        (found,) = [each for each in entries if each.station == station]
        return found


@pytest.fixture
def halls(store: Store, tmp_path: Path) -> tuple[Hall, Hall]:
    one, two = (Hall(name, store, tmp_path / name, tmp_path / "blobs") for name in ("one", "two"))
    (tmp_path / "one" / "measurements").mkdir(parents=True)
    (tmp_path / "one" / "measurements" / NAME).write_bytes(measurement())
    return one, two


def test_what_one_station_measured_is_opened_on_another(halls: tuple[Hall, Hall]) -> None:
    one, two = halls
    lying = one.entry("one")
    with pytest.raises(NotAllowed, match="not a file of this station"):
        share(two.library, two.index, lying)
    shared = share(one.library, one.index, lying)
    assert (shared.station, shared.name, shared.latest.axis.serial) == ("", f"one {NAME}", 7)
    assert fetch(two.library, two.index, two.entry("")) == shared.name
    opened = two.measurements.load(shared.name)
    assert opened.head.drive == "X"
    assert opened.arrays["velocity"].size == 200_000
    assert two.entry("two").name == shared.name
    # Again is no harm and no new version.
    assert share(one.library, one.index, lying).versions == 1
    assert fetch(two.library, two.index, two.entry("")) == shared.name


def test_stations_with_files_of_one_name_do_not_overwrite_each_other(
    halls: tuple[Hall, Hall],
) -> None:
    one, two = halls
    two.measurements.store(NAME, measurement("Y"))
    names = {share(hall.library, hall.index, hall.entry(hall.name)).name for hall in halls}
    assert names == {f"one {NAME}", f"two {NAME}"}
    assert one.measurements.load(NAME).head.drive == "X"
    # What lies there under the same name stays as it is.
    two.measurements.store(f"one {NAME}", measurement("Z"))
    entries, _ = two.library.search(Query(words=f"one {NAME}"))
    shared = next(each for each in entries if each.station == "")
    with pytest.raises(NotAllowed, match="already"):
        fetch(two.library, two.index, shared)
    assert two.measurements.load(f"one {NAME}").head.drive == "Z"


def test_nothing_that_is_damaged_comes_into_the_folder(
    halls: tuple[Hall, Hall], tmp_path: Path
) -> None:
    one, two = halls
    share(one.library, one.index, one.entry("one"))
    (blob,) = [path for path in (tmp_path / "blobs").rglob("*") if path.is_file()]
    blob.write_bytes(b"\0" + blob.read_bytes()[1:])
    with pytest.raises(BlobFailed, match="damaged"):
        fetch(two.library, two.index, two.entry(""))
    wrong = one.library.add("measurement", "one no.sdmeas", b"no measurement", Addition())
    for name in ("../up.sdmeas", "one.txt"):
        odd = one.library.add("measurement", name, b"x", Addition())
        with pytest.raises(NotAllowed, match="not a file name"):
            fetch(two.library, two.index, odd)
    with pytest.raises(NotAllowed, match="no measurement"):
        fetch(two.library, two.index, wrong)
    assert list((tmp_path / "two" / "measurements").glob("*")) == []
