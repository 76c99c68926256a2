"""The scene shows states by signs: viser has one label for everybody, whatever their language."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import pytest

from backend.scene.feed import _shown, look_of
from backend.scene.geometry import Travel
from backend.scene.view import COLOURS, SIGNS, SceneView, _Parts
from drivers.cia402 import State

#: CiA 402-2, states of the FSA and supported functions: the drive function is enabled, so that the
#: motor has torque. So it is in "Fault reaction active", which shows as a fault.
TORQUE = {State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE}


def labelled(state: State, *, fresh: bool, position_rev: float | None) -> str:
    """What is above the motor of an axis in this state."""
    snapshot = SimpleNamespace(state=state, fresh=fresh)
    axis: Any = SimpleNamespace(
        connected=SimpleNamespace(monitor=SimpleNamespace(snapshot=snapshot)),
        position_rev=position_rev,
        travel=Travel(5.0, 0.5, "mm"),
    )
    shown: list[str] = []
    colours: list[tuple[int, int, int]] = []
    look: Any = SimpleNamespace(name="轴 X")
    root: Any = None
    parts = _Parts(look, root, colour=colours.append, label=shown.append)
    view = SceneView.__new__(SceneView)
    view._axes = {"x": parts}
    view.show("x", *_shown(axis))
    assert colours[0] in COLOURS.values()
    return shown[0]


@pytest.mark.parametrize("fresh", [True, False])
@pytest.mark.parametrize("position_rev", [None, 2.5])
@pytest.mark.parametrize("state", State)
def test_a_label_has_no_word_of_a_state(
    state: State, fresh: bool, position_rev: float | None
) -> None:
    label = labelled(state, fresh=fresh, position_rev=position_rev)
    place = " 12.50 mm" if fresh and position_rev is not None else ""
    assert re.fullmatch(r"轴 X \[[IO!?]\]" + place, label), label


@pytest.mark.parametrize("state", State)
def test_the_sign_shows_torque_and_faults(state: State) -> None:
    look = look_of(state, fresh=True)
    assert (look == "on") is (state in TORQUE)
    assert (look == "fault") is state.value.startswith("Fault")
    assert (look == "unknown") is (state is State.UNKNOWN)
    assert look_of(state, fresh=False) == "unknown"
    assert len(set(SIGNS.values())) == len(SIGNS)
