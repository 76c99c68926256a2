"""The parts of the scene on a viser server, and their movement.

viser is the library for the 3D scene; its server listens on loopback only and is reached through
servodeck's server (`backend.api.scope.scene`).
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import viser

from backend.axes.scales.gear_calculator import Mechanics
from backend.scene.geometry import HALF_TRACK, Track, Travel, turn

#: Distance of two axes; the page's camera uses it too (webui/src/pages/scene/SceneFrame.tsx).
_SPACING = 0.9
#: Smallest movement that is shown [rev]: 0.007°, ten times the noise of an encoder.
LEAST_REV = 2e-5
_MOTOR_X = -1.25
_HEIGHT = 0.2
_DARK, _STEEL, _MARK = (60, 64, 72), (150, 158, 168), (235, 120, 30)
_ROD, _LIMIT, _HOME = (190, 196, 204), (200, 40, 40), (40, 120, 210)
#: State of an axis as the scene shows it, without text: viser has one label for all viewers,
#: whatever their language. The page lists the axes with the same signs and the names of their
#: states (webui/src/pages/scene/SceneStates.tsx). I and O are the marks of a switch (IEC 60417:
#: 5007 and 5008).
Look = Literal["on", "off", "fault", "unknown"]
#: Colours as on the page for the same states; the sign shows the state as well.
COLOURS: dict[Look, tuple[int, int, int]] = {
    "on": (40, 150, 70),
    "off": (120, 126, 136),
    "fault": (200, 40, 40),
    "unknown": (120, 126, 136),
}
SIGNS: dict[Look, str] = {"on": "I", "off": "O", "fault": "!", "unknown": "?"}
_ALONG_X = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
_ALONG_Y = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class AxisLook:
    """Data that determine the parts of an axis."""

    name: str
    mechanics: Mechanics | None
    travel: Travel
    track: Track


@dataclass(slots=True)
class _Parts:
    look: AxisLook
    root: viser.FrameHandle
    turning: list[tuple[viser.FrameHandle, str, float]] = field(default_factory=list)
    sliding: viser.FrameHandle | None = None
    shown_rev: float | None = None
    colour: Callable[[tuple[int, int, int]], None] = lambda _: None
    label: Callable[[str], None] = lambda _: None


def _same(shown_rev: float | None, revolutions: float) -> bool:
    return shown_rev is not None and abs(revolutions - shown_rev) < LEAST_REV


class SceneView:
    """A viser server with one set of parts for each axis. Methods may be called from any thread.

    Raises:
        OSError: no port of the loopback interface is free.
    """

    def __init__(self) -> None:
        logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
        # viser takes the first free port from the given one on; with 0 the system chooses one.
        self._server = viser.ViserServer(host="127.0.0.1", port=0, label="servodeck", verbose=False)
        self._server.gui.configure_theme(show_logo=False, show_share_button=False)
        self._server.gui.main_panel.minimize()
        self._server.scene.set_up_direction("+z")
        self._server.scene.add_grid("/floor", width=6, height=12, cell_size=0.2)
        self._server.initial_camera.position = (0.3, -2.3, 1.5)
        self._server.initial_camera.look_at = (0.0, 0.0, 0.1)
        self._axes: dict[str, _Parts] = {}

    @property
    def port(self) -> int:
        """Port of the server on the loopback interface."""
        return self._server.get_port()

    def arrange(self, axes: dict[str, AxisLook]) -> None:
        """Build the scene from these axes; nothing is done where they are unchanged."""
        order = list(axes)
        if order == list(self._axes) and all(self._axes[d].look == axes[d] for d in order):
            return
        with self._server.atomic():
            for parts in self._axes.values():
                parts.root.remove()
            self._axes = {
                drive: self._build(drive, look, (len(order) / 2 - 0.5 - place) * _SPACING)
                for place, (drive, look) in enumerate(axes.items())
            }

    def move(self, positions_rev: dict[str, float]) -> None:
        """Move the parts of these axes to the motors' positions; nothing is sent at standstill."""
        with self._server.atomic():
            for drive, revolutions in positions_rev.items():
                parts = self._axes.get(drive)
                if parts is None or _same(parts.shown_rev, revolutions):
                    continue
                parts.shown_rev = revolutions
                for node, axis, ratio in parts.turning:
                    node.wxyz = turn(revolutions * ratio, axis)
                if parts.sliding is not None:
                    look = parts.look
                    x = look.track.place(revolutions * look.travel.per_rev)
                    parts.sliding.position = (x, 0.0, 0.0)

    def show(self, drive: str, look: Look, place: str) -> None:
        """Set the motor's colour, and the label above it: name, sign of the state, position."""
        parts = self._axes.get(drive)
        if parts is not None:
            parts.colour(COLOURS[look])
            parts.label(" ".join(filter(None, (parts.look.name, f"[{SIGNS[look]}]", place))))

    def close(self) -> None:
        """End the server and its thread."""
        self._server.stop()

    # --- parts ------------------------------------------------------------------------

    def _build(self, drive: str, look: AxisLook, y: float) -> _Parts:
        scene = self._server.scene
        root_name = f"/axes/{drive}"
        root = scene.add_frame(root_name, show_axes=False, position=(0.0, y, 0.0))
        parts = _Parts(look, root)
        kind = look.mechanics.kind if look.mechanics is not None else None
        motor = scene.add_box(
            f"{root_name}/motor",
            color=COLOURS["unknown"],
            dimensions=(0.34, 0.26, 0.26),
            position=(_MOTOR_X, 0.0, _HEIGHT),
        )
        label = scene.add_label(f"{root_name}/name", look.name, position=(_MOTOR_X, 0.0, 0.5))

        def colour(rgb: tuple[int, int, int]) -> None:
            motor.color = rgb

        def words(text: str) -> None:
            label.text = text

        parts.colour, parts.label = colour, words
        self._shaft(root_name, parts)
        if kind == "rotary":
            self._table(root_name, parts)
        elif kind is not None:
            self._slide(root_name, parts, screw=kind == "screw")
        return parts

    def _shaft(self, root: str, parts: _Parts) -> None:
        """The motor's shaft with a disc and a mark, turning about x."""
        scene = self._server.scene
        name = f"{root}/shaft"
        shaft = scene.add_frame(name, show_axes=False, position=(_MOTOR_X + 0.2, 0.0, _HEIGHT))
        scene.add_cylinder(f"{name}/disc", 0.12, 0.03, color=_STEEL, wxyz=_ALONG_X)
        scene.add_box(
            f"{name}/mark", color=_MARK, dimensions=(0.035, 0.025, 0.1), position=(0, 0, 0.06)
        )
        parts.turning.append((shaft, "x", 1.0))

    def _table(self, root: str, parts: _Parts) -> None:
        """A round table that turns about z, with a mark and a fixed pointer at its zero."""
        scene = self._server.scene
        name = f"{root}/table"
        table = scene.add_frame(name, show_axes=False, position=(0.0, 0.0, _HEIGHT))
        scene.add_cylinder(f"{name}/plate", 0.4, 0.06, color=_STEEL)
        scene.add_box(
            f"{name}/mark", color=_MARK, dimensions=(0.3, 0.03, 0.02), position=(0.22, 0, 0.04)
        )
        scene.add_box(
            f"{root}/zero", color=_HOME, dimensions=(0.12, 0.02, 0.02), position=(0.5, 0, _HEIGHT)
        )
        parts.turning.append((table, "z", parts.look.travel.load_turns_per_rev))

    def _slide(self, root: str, parts: _Parts, *, screw: bool) -> None:
        """A track with a carriage: on a screw that turns, or between two pulleys."""
        scene = self._server.scene
        look = parts.look
        scene.add_box(
            f"{root}/bed",
            color=_DARK,
            dimensions=(2 * HALF_TRACK + 0.3, 0.3, 0.05),
            position=(0.0, 0.0, 0.03),
        )
        ratio = look.travel.load_turns_per_rev
        if screw:
            name = f"{root}/screw"
            rod = scene.add_frame(name, show_axes=False, position=(0.0, 0.0, _HEIGHT))
            scene.add_cylinder(f"{name}/rod", 0.035, 2.1, color=_ROD, wxyz=_ALONG_X)
            scene.add_box(
                f"{name}/mark", color=_MARK, dimensions=(2.0, 0.012, 0.012), position=(0, 0, 0.035)
            )
            parts.turning.append((rod, "x", ratio))
        else:
            for place, x in (("near", -HALF_TRACK - 0.1), ("far", HALF_TRACK + 0.1)):
                name = f"{root}/{place}"
                pulley = scene.add_frame(name, show_axes=False, position=(x, 0.0, _HEIGHT))
                scene.add_cylinder(f"{name}/wheel", 0.09, 0.12, color=_STEEL, wxyz=_ALONG_Y)
                scene.add_box(
                    f"{name}/mark",
                    color=_MARK,
                    dimensions=(0.02, 0.125, 0.08),
                    position=(0, 0, 0.05),
                )
                parts.turning.append((pulley, "y", ratio))
            for place, z in (("upper", 0.09), ("lower", -0.09)):
                scene.add_box(
                    f"{root}/{place}",
                    color=_DARK,
                    dimensions=(2 * HALF_TRACK + 0.2, 0.09, 0.01),
                    position=(0.0, 0.0, _HEIGHT + z),
                )
        name = f"{root}/carriage"
        parts.sliding = scene.add_frame(name, show_axes=False)
        scene.add_box(
            f"{name}/body",
            color=_STEEL,
            dimensions=(0.18, 0.26, 0.12),
            position=(0, 0, _HEIGHT + 0.1),
        )
        self._posts(root, look)

    def _posts(self, root: str, look: AxisLook) -> None:
        """Red posts at the software limits, a blue one at zero where the track shows it."""
        posts = [("home", 0.0, _HOME)] if look.track.low <= 0 <= look.track.high else []
        if look.track.limited:
            posts += [("low", look.track.low, _LIMIT), ("high", look.track.high, _LIMIT)]
        for name, travel, colour in posts:
            self._server.scene.add_box(
                f"{root}/{name}",
                color=colour,
                dimensions=(0.02, 0.03, 0.25),
                position=(look.track.place(travel), -0.2, 0.13),
            )
