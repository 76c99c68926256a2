"""A fresh drive that gets nothing but the writes of a start-up list holds the set."""

from __future__ import annotations

from functools import cache

import pytest

from backend.handover.files import FORMATS, Format, files_of
from backend.handover.model import hand_over
from backend.handover.read import read_list
from backend.parameters.set_file import ParameterSet
from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import make_device
from profiles.schema import Profile, Raw
from tests.support.handed_over import (
    EVERY,
    SAVED,
    profile_of,
    replay,
    set_of_device,
    settings,
    tuned_device,
    values,
)

READABLE = tuple(form for form in FORMATS if form != "python")


@cache
def tuned(family: str) -> tuple[Profile, ParameterSet, dict[str, Raw]]:
    """Profile, set of a drive whose settings were changed, and what a fresh drive holds."""
    profile = profile_of(family)
    content = set_of_device(profile, tuned_device(profile))
    return profile, content, values(fresh(profile), settings(profile))


def fresh(profile: Profile) -> Device:
    device = make_device(profile)
    device.advance(0)
    return device


@pytest.mark.parametrize("form", READABLE)
@pytest.mark.parametrize("family", EVERY)
def test_a_fresh_drive_holds_exactly_the_set(family: str, form: Format) -> None:
    profile, content, factory = tuned(family)
    axis = hand_over(content, profile)
    if form not in ("dcf", "csv", "ros2") and profile.link("ethercat") is None:
        pytest.skip("no EtherCAT drive")
    listed = read_list(files_of(axis, form, "list", SAVED)["list"], profile)
    assert listed.writes
    device = fresh(profile)
    replay(device, listed)
    now = values(device, settings(profile))
    wanted = {row.key: row.raw for row in content.rows}
    left_out = {each.key for each in axis.left_out}
    different = {k: (now[k], wanted[k]) for k in now if now[k] != wanted[k]}
    assert set(different) <= left_out
    # The test means something: most settings were changed.
    assert sum(wanted[key] != factory[key] for key in wanted) > len(wanted) / 3
