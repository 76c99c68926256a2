"""Which virtual drives there are and which wires they hang on, as read from a bench file.

::

    [[axis]]
    name = "X"
    drive = "mms7"
    on = "mlink://virtual0"
    station = 1
    also_on = "modbus://virtual0"      # a second port of the same drive, where it has one
    also_station = 1
    [axis.mechanics.motor]
    …
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.errors import NotAllowed
from drivers.urls import parse_url
from drivers.virtual.mechanics.spec import MechanicsSpec, standard_mechanics

STANDARD_BENCH = Path(__file__).with_name("standard_bench.toml")


class AxisSpec(BaseModel):
    """One virtual drive."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1, max_length=60)
    drive: str
    on: str
    station: int = Field(default=1, ge=0, le=65535)
    also_on: str | None = None
    also_station: int | None = None
    serial: int | None = None
    mechanics: MechanicsSpec = Field(default_factory=standard_mechanics)

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

    def urls(self, scheme: str | None = None) -> list[str]:
        """Bus URLs in the order they appear, of one scheme where given."""
        seen = dict.fromkeys(url for axis in self.axis for url, _ in axis.ports)
        return [url for url in seen if scheme is None or parse_url(url).scheme == scheme]

    def on(self, url: str) -> list[tuple[AxisSpec, int]]:
        """Drives on a bus with their stations there."""
        return [(axis, s) for axis in self.axis for u, s in axis.ports if u == url]


def load_bench(path: Path = STANDARD_BENCH) -> BenchSpec:
    """Read a bench file (TOML, or JSON of the same shape); mechanics paths are beside it.

    Raises:
        NotAllowed: the file is missing or wrong; the message names the field.
    """
    try:
        text = path.read_text("utf-8")
        content = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
        for axis in content.get("axis", []):
            if isinstance(axis.get("mechanics"), str):
                beside = path.parent / axis["mechanics"]
                axis["mechanics"] = tomllib.loads(beside.read_text("utf-8"))
        bench = BenchSpec.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise NotAllowed(
            f"bench file {path}: {place}: {first['msg']}",
            value=str(path),
            remedy="see docs/virtual-drives.md",
        ) from error
    except (OSError, ValueError) as error:
        raise NotAllowed(
            f"bench file {path}: {error}", value=str(path), remedy="see docs/virtual-drives.md"
        ) from error
    _check_stations(bench, path)
    return bench


def _check_stations(bench: BenchSpec, path: Path) -> None:
    for url in bench.urls():
        stations = [station for _, station in bench.on(url)]
        twice = sorted({s for s in stations if stations.count(s) > 1})
        if twice:
            raise NotAllowed(
                f"bench file {path}: station {twice[0]} of {url} is given twice",
                value=twice[0],
                remedy="give each drive of a bus a station of its own",
            )
