"""Fixed PDOs of files whose indices are not those of PDOs."""

from __future__ import annotations

import pytest

from drivers.canopen.exchange.fixed_pdo import fixed_pdos
from drivers.canopen.link import CanopenLink
from profiles import load_profile
from profiles.schema import PdoIdentifier, PdoSet, PdoSpec, Profile


def with_sets(*sets: PdoSet) -> Profile:
    spec = PdoSpec(sets=sets, default_rx=0x1600, default_tx=0x1A00, max_entries=8, source="test")
    return load_profile("mms7").model_copy(update={"pdo": spec})


def fixed(index: int, direction: str, identifier: PdoIdentifier | None = None) -> PdoSet:
    key = "6040:00" if direction == "rx" else "6041:00"
    return PdoSet.model_validate(
        {
            "index": index, "direction": direction, "entries": (key,), "fixed": True,
            "identifier": identifier, "source": "test",
        }
    )  # fmt: skip


@pytest.mark.parametrize("identifier", [None, PdoIdentifier(cob_id=0x333, of_node=False)])
@pytest.mark.parametrize(
    ("index", "direction"),
    [
        (0x1500, "rx"),
        (0x15FF, "rx"),
        (0x1800, "rx"),
        (0x1600, "tx"),
        (0x19FF, "tx"),
        (0x1C00, "tx"),
    ],
)
def test_a_set_that_is_no_pdo_of_its_direction_is_left_out(
    index: int, direction: str, identifier: PdoIdentifier | None
) -> None:
    """Far below 1600h the attachment ended with an IndexError; just below it was another PDO."""
    good = (fixed(0x1600, "rx"), fixed(0x1A01, "tx"))
    profile = with_sets(*good, fixed(index, direction, identifier))
    found = fixed_pdos(profile, 5)
    assert [(pdo.direction, pdo.number, pdo.cob_id) for pdo in found] == [
        ("rx", 0, 0x205),
        ("tx", 1, 0x285),
    ]
    CanopenLink("canopen://virtual/odd-pdos").attach(5, profile)
