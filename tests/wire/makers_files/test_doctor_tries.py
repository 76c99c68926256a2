"""The doctor tries another setting on a slave that insists on that of its file, and undoes it."""

from __future__ import annotations

import pytest

from backend.commands.buses.doctor import tried
from backend.station.doctor import examined
from drivers.virtual.wires.netns import Namespace
from profiles.schema import Profile
from tests.wire.makers_files.test_bring_up import brought, namespace, profile_of

__all__ = ["namespace"]


def _with_activate(profile: Profile, value: int) -> Profile:
    rules = profile.bring_up
    assert rules is not None
    mode = rules.clock_mode or rules.clock_modes[0]
    wrong = mode.model_copy(update={"assign_activate": value})
    return profile.model_copy(
        update={"bring_up": rules.model_copy(update={"clock_modes": (wrong,)})}
    )


def _as_remappable(profile: Profile) -> Profile:
    assert profile.pdo is not None
    assert profile.bring_up is not None
    sets = tuple(each.model_copy(update={"fixed": False}) for each in profile.pdo.sets)
    coe = profile.bring_up.coe.model_copy(update={"pdo_config": True})
    return profile.model_copy(
        update={
            "pdo": profile.pdo.model_copy(update={"remappable": True, "sets": sets}),
            "bring_up": profile.bring_up.model_copy(update={"coe": coe}),
        }
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "setting", "after"),
    [
        ("two_pulses", "bring_up.clock_modes", "0700h"),
        ("without_clock", "bring_up.clock_modes", "0000h"),
        ("two_each_way", "pdo.remappable", "false"),
    ],
)
async def test_a_wrong_setting_is_found(
    namespace: Namespace, name: str, setting: str, after: str
) -> None:
    right = profile_of(name)
    wrong = _as_remappable(right) if setting.startswith("pdo") else _with_activate(right, 0x300)
    async with brought(namespace, name) as (link, segment):
        link.attach(1, wrong)
        first = await examined(link, 1)
        assert not first.reached
        found = await tried(link, 1, wrong, first.causes)
        last = found[-1]
        assert (last["setting"], last["after"], last["reached"]) == (setting, after, True), found
        # Nothing of it is left: the drive is out of Operational, and refuses as before.
        assert segment.command("state")["slaves"][0]["state"] != "OP"
        again = await examined(link, 1)
        assert [cause.code for cause in again.causes] == [cause.code for cause in first.causes]
