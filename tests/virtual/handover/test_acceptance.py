"""Controllers accept all that is exported, and a fresh drive then holds it: all families, formats.

The readers in `tests.support.controllers` are written from the controllers' documentation and
share nothing with the reader of the comparison.
"""

from __future__ import annotations

import pytest

from backend.records.handover.files import FORMATS, Format, files_of
from drivers.virtual.firmware.factory import make_device
from tests.support.controllers import text_files, xml_files
from tests.support.controllers.acceptance import Outcome, axis_of, outcome, table, tuned
from tests.support.controllers.consumed import Refused
from tests.support.handed_over import EVERY, SAVED, profile_of, settings, values

FOUND: list[Outcome] = []


@pytest.mark.long(keep=9)
@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("family", EVERY)
def test_the_controller_takes_every_value_and_a_fresh_drive_holds_it(
    family: str, form: Format
) -> None:
    found = outcome(family, form)
    FOUND.append(found)
    if found.writes:
        assert found.writes == len(axis_of(family).writes)


@pytest.mark.parametrize("family", EVERY)
def test_the_tuned_drive_differs_from_a_fresh_one(family: str) -> None:
    # Else a replay that writes nothing would pass as well.
    profile = profile_of(family)
    device = make_device(profile)
    device.advance(0)
    fresh, wanted = values(device, settings(profile)), tuned(family)
    assert sum(wanted[key] != fresh[key] for key in wanted) > len(wanted) / 3


def test_the_table_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    if len(FOUND) != len(EVERY) * len(FORMATS):
        pytest.skip("the table needs every family in every format")
    with capsys.disabled():
        print("\n" + table(FOUND))


def broken(form: Format, old: bytes, new: bytes) -> bytes:
    data = files_of(axis_of("mms7"), form, "list", SAVED)["list"]
    assert old in data
    return data.replace(old, new, 1)


@pytest.mark.parametrize(
    ("form", "old", "new"),
    [
        ("twincat", b"<Ccs>1", b"<Ccs>2"),
        ("twincat", b"<Transition>PS", b"<Transition>OP"),
        ("twincat", b"<Index>", b"<Index>0x"),
        ("lcec", b'subIdx="', b'subIndex="'),
        ("lcec", b'type="generic"', b'type="generic" color="red"'),
        ("lcec", b'refClockSyncCycles="1"', b""),
        ("lcec", b'halType="', b'halType="x'),
        ("codesys", b"Bit length", b"Bits"),
        ("codesys", b"16#", b"0x"),
        ("igh", b"-t uint", b"-t word"),
        ("ros2", b"type: uint16", b"type: word"),
        ("ros2", b"value: ", b"value: 9999999999"),
    ],
)
def test_these_readers_can_refuse(form: Format, old: bytes, new: bytes) -> None:
    read = {
        "twincat": xml_files.twincat,
        "lcec": xml_files.lcec,
        "codesys": text_files.codesys,
        "igh": text_files.igh,
        "ros2": text_files.ros2_ethercat,
    }[form]
    with pytest.raises(Refused):
        read(broken(form, old, new))
