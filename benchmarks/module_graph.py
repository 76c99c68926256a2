"""The rooms of the product as a drawing, made from the imports of the code.

    python -m benchmarks.module_graph            writes docs/images/module-graph.{svg,txt}
    python -m benchmarks.module_graph --figures  prints floors, arrows and upward arrows

A room is a folder of ``backend/`` or ``drivers/``; ``profiles`` is one room. Modules that lie
directly in ``drivers/`` are the room ``drivers`` (`drivers.urls`, which opens every bus, is a
room of its own), and the entry points of the command line belong to ``backend.commands``.
An arrow is at least one import of any module of one room by any module of another. It goes upward
where the layers in ``pyproject.toml`` place the imported room above the importing one.
`tests/unit/test_module_graph.py` compares both files with the imports as they are.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import grimp

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs/images/module-graph.svg"
LIST = ROOT / "docs/images/module-graph.txt"
_PACKAGES = ("backend", "drivers", "profiles")
_LAYERS_OF_ROOMS = "Rooms of the backend import downward"
#: Rooms of `drivers` that no contract orders, from the top.
_DRIVERS = (
    "drivers.virtual", "drivers.urls", "drivers.mlink", "drivers.ethercat", "drivers.canopen",
    "drivers.modbus", "drivers.motion", "drivers",
)  # fmt: skip

Arrow = tuple[str, str]


class Graph(NamedTuple):
    """Rooms with their floor (0 is the lowest), and arrows from importing to imported room."""

    floors: dict[str, int]
    down: frozenset[Arrow]
    up: frozenset[Arrow]

    def within(self, package: str) -> list[Arrow]:
        """Arrows, up and down, between two rooms of a package."""
        return sorted(a for a in self.down | self.up if all(_is_in(r, package) for r in a))


def room_of(module: str) -> str | None:
    """The room of a module; None for the package ``backend`` itself, which holds the version."""
    parts = module.split(".")
    if parts[0] == "profiles":
        return "profiles"
    if parts[0] == "drivers":
        name = ".".join(parts[:2])
        return name if name in _DRIVERS else "drivers"
    if len(parts) == 1:
        return None
    return "backend.commands" if parts[1] in ("__main__", "cli") else ".".join(parts[:2])


def read_graph() -> Graph:
    """The rooms and arrows of the code as it is on the disk."""
    graph = grimp.build_graph(*_PACKAGES, cache_dir=None)
    arrows: set[Arrow] = set()
    for module in graph.modules:
        for imported in graph.find_modules_directly_imported_by(module):
            arrow = room_of(module), room_of(imported)
            if arrow[0] is not None and arrow[1] is not None and arrow[0] != arrow[1]:
                arrows.add((arrow[0], arrow[1]))
    order = [*_layers(), *_DRIVERS, "profiles"]
    strangers = {room for arrow in arrows for room in arrow} - set(order)
    if strangers:
        raise SystemExit(f"rooms without a layer in pyproject.toml: {', '.join(sorted(strangers))}")
    rank = {room: number for number, room in enumerate(order)}
    down = frozenset(a for a in arrows if rank[a[0]] < rank[a[1]])
    return Graph(_floors(order, down), down, frozenset(arrows - down))


def _floors(order: Sequence[str], down: Iterable[Arrow]) -> dict[str, int]:
    """Each room stands one floor above the highest one that it imports."""
    floors = dict.fromkeys(order, 0)
    for room in reversed(order):
        below = [floors[imported] for importing, imported in down if importing == room]
        floors[room] = 1 + max(below, default=-1)
    return floors


def needed(down: Iterable[Arrow]) -> list[Arrow]:
    """Arrows that no longer way along other arrows implies (transitive reduction)."""
    below: dict[str, set[str]] = {}
    for importing, imported in down:
        below.setdefault(importing, set()).add(imported)

    def reaches(start: str, goal: str) -> bool:
        return any(n == goal or reaches(n, goal) for n in below.get(start, ()))

    return sorted((a, b) for a, b in down if not any(reaches(n, b) for n in below[a] if n != b))


def figures(graph: Graph) -> str:
    """Floors and arrows of ``backend``, compared with the aims of the floor plan."""
    rooms = [room for room in graph.floors if _is_in(room, "backend")]  # from the top
    inside = graph.within("backend")
    up = [a for a in inside if a in graph.up]
    floors = 1 + max(_floors(rooms, graph.down.intersection(inside)).values())
    return (
        f"backend: {len(rooms)} rooms on {floors} floors (aim: at most 13), "
        f"{len(inside)} arrows between them (aim: at most 40), {len(up)} of them upward"
    )


def as_list(graph: Graph) -> str:
    """Every arrow on a line of its own, and the figures."""
    lines = ["# Written by benchmarks/module_graph.py from the imports of the code.", ""]
    lines += [f"# {figures(graph)}", ""]
    floor = -1
    for room in sorted(graph.floors, key=lambda r: (-graph.floors[r], r)):
        if graph.floors[room] != floor:
            floor = graph.floors[room]
            rooms = sorted(each for each, its in graph.floors.items() if its == floor)
            lines.append(f"floor {floor}: {', '.join(rooms)}")
        for importing, imported in sorted(graph.down | graph.up):
            if importing == room:
                upward = "  (upward)" if (importing, imported) in graph.up else ""
                lines.append(f"  {importing} -> {imported}{upward}")
    return "\n".join(lines) + "\n"


_WIDTH, _ROW, _BOX_H, _MARGIN = 1000, 78, 30, 60


def as_svg(graph: Graph) -> str:
    """Floors from top to bottom, arrows that no other implies, and upward arrows in red."""
    places = _placed(graph)
    height = (max(graph.floors.values()) + 1) * _ROW + 70
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" '
        'font-family="sans-serif" font-size="13">',
        "<title>Rooms of backend, drivers and profiles, from the imports of the code</title>",
        "<defs>",
        *(
            f'<marker id="{name}" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" '
            f'markerHeight="7" orient="auto"><path d="M0 0L8 4L0 8z" fill="{colour}"/></marker>'
            for name, colour in (("down", "#607080"), ("up", "#c02020"))
        ),
        "</defs>",
        f'<rect width="{_WIDTH}" height="{height}" fill="#ffffff"/>',
    ]
    for floor in range(max(graph.floors.values()) + 1):
        y = _y(graph, floor)
        parts.append(f'<text x="12" y="{y + 5}" fill="#8090a0">{floor}</text>')
        parts.append(f'<path d="M36 {y + 39}H{_WIDTH}" stroke="#eef1f4"/>')
    for importing, imported in needed(graph.down):
        parts.append(_arrow(places[importing], places[imported], up=False))
    for importing, imported in sorted(graph.up):
        parts.append(_arrow(places[importing], places[imported], up=True))
    for room, (x, y) in sorted(places.items()):
        parts += _box(room, x, y)
    note = "Grey: imports downward that no other arrows imply. Red, dashed: imports upward."
    parts.append(f'<text x="36" y="{height - 16}" fill="#405060">{note}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def _placed(graph: Graph) -> dict[str, tuple[int, int]]:
    """Middle of each room's box; rooms of a floor lie side by side in the order of their names."""
    places: dict[str, tuple[int, int]] = {}
    for floor in set(graph.floors.values()):
        rooms = sorted(room for room, its in graph.floors.items() if its == floor)
        step = (_WIDTH - 2 * _MARGIN) / len(rooms)
        # Floors with one room are shifted in turn, so that their arrows do not lie on one another.
        shift = 150 * (floor % 3 - 1) if len(rooms) == 1 else 0
        for number, room in enumerate(rooms):
            places[room] = (round(_MARGIN + step * (number + 0.5) + shift), _y(graph, floor))
    return places


def _y(graph: Graph, floor: int) -> int:
    return (max(graph.floors.values()) - floor) * _ROW + 40


def _arrow(start: tuple[int, int], end: tuple[int, int], *, up: bool) -> str:
    half = -_BOX_H // 2 if up else _BOX_H // 2
    (x1, y1), (x2, y2) = start, end
    y1, y2 = y1 + half, y2 - half
    bend = round((y2 - y1) / 2)
    name, look = (
        ("up", 'stroke="#c02020" stroke-dasharray="5 4"')
        if up
        else (
            "down",
            'stroke="#607080"',
        )
    )
    return (
        f'<path d="M{x1} {y1}C{x1} {y1 + bend} {x2} {y2 - bend} {x2} {y2}" fill="none" {look} '
        f'marker-end="url(#{name})"/>'
    )


def _box(room: str, x: int, y: int) -> list[str]:
    package = room.partition(".")[0]
    fill = {"backend": "#dce9f7", "drivers": "#e3f2df", "profiles": "#f8ecd4"}[package]
    text = room.removeprefix("backend.")
    width = max(70, 8 * len(text) + 16)
    return [
        f'<rect x="{x - width // 2}" y="{y - _BOX_H // 2}" width="{width}" height="{_BOX_H}" '
        f'rx="5" fill="{fill}" stroke="#8aa0b4"/>',
        f'<text x="{x}" y="{y + 5}" text-anchor="middle" fill="#102030">{text}</text>',
    ]


def _layers() -> list[str]:
    """Rooms of the backend from the top, as the import contract has them."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    layers: list[str] = next(c["layers"] for c in contracts if c["name"] == _LAYERS_OF_ROOMS)
    return layers


def _is_in(room: str, package: str) -> bool:
    return room.partition(".")[0] == package


def write() -> None:
    """Write the drawing and the list, or print the figures."""
    graph = read_graph()
    if "--figures" not in sys.argv:
        PICTURE.write_text(as_svg(graph), "utf-8")
        LIST.write_text(as_list(graph), "utf-8")
    print(figures(graph))


if __name__ == "__main__":
    write()
