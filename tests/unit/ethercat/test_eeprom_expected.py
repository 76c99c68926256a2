"""The contents of an EEPROM compared with numbers of a maker's file that cannot be."""

from __future__ import annotations

import pytest

from drivers.ethercat.eeprom.expected import against_profile
from drivers.ethercat.eeprom.image import Image
from profiles import load_profile
from profiles.bring_up import BringUp


@pytest.mark.parametrize(
    ("stated", "differs"),
    [(2048, False), (4096, True), (64, False), (127, False), (0, False), (1 << 40, False)],
)
def test_a_size_that_no_eeprom_has_is_not_compared(stated: int, differs: bool) -> None:
    """`ByteSize` of a file is free text: 64 made a negative number of units."""
    image = Image(bytes(124) + (2048 // 128 - 1).to_bytes(2, "little") + bytes(1922))
    rules = BringUp(eeprom_bytes=stated, source="a.xml")
    profile = load_profile("mms7").model_copy(update={"bring_up": rules})
    fields = {each.field for each in against_profile(image, profile)}
    assert ("size" in fields) is differs
