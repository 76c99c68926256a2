"""The virtual drives of a bench file and the wires to which they are connected.

::

    [[axis]]
    name = "X"
    drive = "mms7"
    on = "mlink://virtual0"
    station = 1
    also_on = "modbus://virtual0"      # a second port of the same drive, if it has one
    also_station = 1
    connected = true                   # the demo connects it at its start
    moves = {kind = "screw", lead_mm = 10}    # mechanics that the page shows
    defects = ["coupling_loose"]       # of drivers.virtual.defects
    [axis.mechanics.motor]
    …

    [[gantry]]                         # a beam between two drives of one EtherCAT segment
    axes = ["X", "Y"]
    …
"""

from __future__ import annotations

import json
import tomllib
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.message import Text, joined, text
from drivers.texts.message import reason_of as reason_of_failure
from drivers.texts.profile_errors import profile_error_text
from drivers.texts.validation import reason_of
from drivers.urls import parse_url
from drivers.virtual.defects import (
    DEFECTS,
    OF_GANTRY,
    OF_LOAD,
    OUT_OF_SQUARE_RAD,
    Defect,
    planted,
)
from drivers.virtual.mechanics.gantry import GantrySpec
from drivers.virtual.mechanics.rough import RoughTorqueSpec
from drivers.virtual.mechanics.spec import MechanicsSpec, standard_mechanics
from profiles.loader import ProfileError, load_profile

#: Highest station of each bus: MODBUS over Serial Line V1.02 clause 2.2, CiA 301 clause 7.2.1, and
#: the positions of an EtherCAT segment (16-bit addresses).
_LAST_STATION = {"mlink": 247, "modbus": 247, "canopen": 127, "ethercat": 65535}
STANDARD_BENCH = Path(__file__).with_name("standard_bench.toml")
#: Further benches of the product, by the name that ``servodeck demo --bench`` takes.
NAMED_BENCHES = {"gantry": Path(__file__).with_name("gantry_bench.toml")}


class AxisSpec(BaseModel):
    """One virtual drive."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1, max_length=60)
    drive: str
    on: str
    station: int = Field(default=1, ge=0, le=65535)
    also_on: str | None = None
    also_station: int | None = None
    serial: int | None = Field(default=None, ge=1, le=0xFFFFFFFF)
    connected: bool = False
    #: Mechanics driven by the shaft, in the form of `Mechanics` (backend/axes/scales).
    moves: dict[str, str | int | float] = Field(default_factory=dict)
    #: As in the file; `load_bench` adds the defects.
    mechanics: MechanicsSpec = Field(default_factory=standard_mechanics)
    defects: tuple[Defect, ...] = ()

    @property
    def serial_number(self) -> int:
        """The bench's serial number, or one derived from bus and station, unique within a bench."""
        if self.serial is not None:
            return self.serial
        return 0x56000000 | (zlib.crc32(self.on.encode()) & 0xFFFF) << 8 | self.station & 0xFF

    @property
    def ports(self) -> tuple[tuple[str, int], ...]:
        """Bus URL and station of each port."""
        first = (self.on, self.station)
        if self.also_on is None:
            return (first,)
        station = self.station if self.also_station is None else self.also_station
        return (first, (self.also_on, station))


class BenchSpec(BaseModel):
    """A bench of virtual drives."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    axis: tuple[AxisSpec, ...] = Field(min_length=1)
    gantry: tuple[GantrySpec, ...] = ()

    def urls(self, scheme: str | None = None) -> list[str]:
        """Return bus URLs in order of appearance, optionally of one scheme."""
        seen = dict.fromkeys(url for axis in self.axis for url, _ in axis.ports)
        return [url for url in seen if scheme is None or parse_url(url).scheme == scheme]

    def on(self, url: str) -> list[tuple[AxisSpec, int]]:
        """Return the drives on a bus with their stations there."""
        return [(axis, s) for axis in self.axis for u, s in axis.ports if u == url]


def bench_file(chosen: Path | None) -> Path:
    """Return the file of a bench: itself, that of a name, or of the standard bench for None.

    An existing file comes before a name.
    """
    if chosen is None:
        return STANDARD_BENCH
    return chosen if chosen.exists() else NAMED_BENCHES.get(str(chosen), chosen)


def load_bench(path: Path = STANDARD_BENCH) -> BenchSpec:
    """Read a bench file (TOML, or JSON of the same form); mechanics paths are relative to it.

    Raises:
        NotAllowed: the file is missing or wrong; the message names the field.
    """
    try:
        content = _content(path)
        bench = BenchSpec.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise NotAllowed(
            "virtual.bench-file-see-docs",
            value=str(path),
            path=str(path),
            place=place,
            first=reason_of(first),
        ) from error
    except OSError as error:
        raise _wrong(path, f"{error.filename or path}: {error.strerror}") from error
    except (ValueError, AttributeError, TypeError) as error:
        raise _wrong(path, reason_of_failure(error)) from error
    _check_names(bench, path)
    _check_stations(bench, path)
    for axis in bench.axis:
        _check_ports(axis, path)
    for gantry in bench.gantry:
        _check_gantry(gantry, bench, path)
    return _with_defects(bench, path)


def write_bench(path: Path, defects: Sequence[str], target: Path) -> None:
    """Write a bench as JSON with further defects, each as ``AXIS=DEFECT``.

    Raises:
        NotAllowed: the file is missing or wrong, no axis has this name, or the defect is unknown.
    """
    load_bench(path)
    content = _content(path)
    axes = {axis["name"]: axis for axis in content["axis"]}
    for each in defects:
        name, _, defect = each.rpartition("=")
        if name not in axes or defect not in DEFECTS:
            raise NotAllowed(
                "virtual.no-such-defect",
                value=each,
                limit=", ".join(DEFECTS),
                path=str(path),
                axes=", ".join(axes),
            )
        axes[name].setdefault("defects", []).append(defect)
    target.write_text(json.dumps(content), "utf-8")


def _content(path: Path) -> dict[str, Any]:
    """Return the content of a bench file, with the mechanics of files next to it."""
    text = path.read_text("utf-8")
    content: dict[str, Any] = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    for axis in content.get("axis", []):
        if isinstance(axis.get("mechanics"), str):
            mechanics_file = path.parent / axis["mechanics"]
            axis["mechanics"] = tomllib.loads(mechanics_file.read_text("utf-8"))
    return content


def _with_defects(bench: BenchSpec, path: Path) -> BenchSpec:
    """Return the bench with the defects of its axes in their mechanics and beams."""
    axes, beams = [], list(bench.gantry)
    for axis in bench.axis:
        mechanics = axis.mechanics
        for defect in axis.defects:
            if defect in OF_LOAD and not mechanics.load:
                raise _no_place(path, axis.name, defect, "load")
            mechanics = planted(mechanics, defect)
            if defect in OF_GANTRY:
                place = next((n for n, beam in enumerate(beams) if axis.name in beam.axes), None)
                if place is None:
                    raise _no_place(path, axis.name, defect, "gantry")
                bent = {"square_error_rad": OUT_OF_SQUARE_RAD}
                beams[place] = beams[place].model_copy(update=bent)
        axes.append(axis.model_copy(update={"mechanics": mechanics}))
    return bench.model_copy(update={"axis": tuple(axes), "gantry": tuple(beams)})


def _no_place(path: Path, name: str, defect: Defect, lacks: str) -> NotAllowed:
    return NotAllowed(
        "virtual.bench-file-defect-needs",
        value=defect,
        path=str(path),
        drive_name=name,
        lacks=lacks,
    )


def _wrong(
    path: Path,
    why: Text | str,
    value: object = None,
    limit: str | Text | None = None,
) -> NotAllowed:
    """Create the error for the file; the remedy is that of ``why``, else to read the docs."""
    return NotAllowed(
        "virtual.bench-file",
        value=str(path) if value is None else value,
        limit=limit,
        remedy=why.remedy() if isinstance(why, Text) else None,
        path=str(path),
        why=why,
    )


def _check_names(bench: BenchSpec, path: Path) -> None:
    names = [axis.name for axis in bench.axis]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise NotAllowed("virtual.bench-file-two-axes", value=twice, path=str(path))


def _check_gantry(gantry: GantrySpec, bench: BenchSpec, path: Path) -> None:
    """Check that both axes are on one EtherCAT segment, with only the beam on their shafts."""
    names = " + ".join(gantry.axes)
    axes = [axis for axis in bench.axis if axis.name in gantry.axes]
    beams = [name for each in bench.gantry for name in each.axes]
    if len(axes) != 2 or any(beams.count(name) > 1 for name in gantry.axes):
        raise NotAllowed("virtual.bench-file-gantry-axes", value=names, path=str(path))
    ports = {url for axis in axes for url, _ in axis.ports}
    if len(ports) != 1 or parse_url(ports.pop()).scheme != "ethercat":
        raise NotAllowed("virtual.bench-file-gantry-bus", value=names, path=str(path))
    for axis in axes:
        m = axis.mechanics
        if m.load or m.load_encoder is not None or m.rough_torque != RoughTorqueSpec():
            raise NotAllowed(
                "virtual.bench-file-gantry-load", value=axis.name, path=str(path), names=names
            )


def _check_ports(axis: AxisSpec, path: Path) -> None:
    """Check that the family has every port, with a station number that the bus allows."""
    try:
        profile = load_profile(axis.drive)
    except ProfileError as error:
        raise _wrong(path, joined((axis.name, profile_error_text(error)), ": ")) from error
    for url, station in axis.ports:
        try:
            bus = parse_url(url)
        except OutOfRange as error:
            raise _wrong(path, joined((axis.name, error.text), ": ")) from error
        kinds = ", ".join(link.kind for link in profile.links)
        if profile.link(bus.scheme) is None:
            why = text(
                "virtual.no-port",
                drive_name=axis.name,
                profile_title=profile.title,
                scheme=bus.scheme,
                kinds=kinds,
            )
            raise _wrong(path, why, url, kinds)
        if bus.scheme == "canopen" and not (bus.is_virtual or bus.place.startswith("slcan/")):
            why = text("virtual.no-such-bus", drive_name=axis.name, bus=str(bus))
            raise _wrong(path, why, url, "canopen://virtual0, canopen://slcan/PATH")
        last = _LAST_STATION[bus.scheme]
        if not 1 <= station <= last:
            why = text(
                "virtual.station-outside",
                drive_name=axis.name,
                station=station,
                url=url,
                last=last,
            )
            raise _wrong(path, why, station, limits.between(1, last))


def _check_stations(bench: BenchSpec, path: Path) -> None:
    for url in bench.urls():
        stations = [station for _, station in bench.on(url)]
        twice = sorted({s for s in stations if stations.count(s) > 1})
        if twice:
            raise NotAllowed(
                "virtual.bench-file-station-given", value=twice[0], path=str(path), url=url
            )
