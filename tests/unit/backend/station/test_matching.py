"""Which profile fits a found drive, by what it says of itself."""

from __future__ import annotations

import pytest

from backend.station.drives import matching
from drivers.link import Found
from profiles.schema import Profile


@pytest.mark.parametrize(
    ("found", "fits"),
    [
        (Found(1, vendor_id=0x2FE, product_code=5), [("certain", "station.match-product")]),
        (Found(1, vendor_id=0x2FE, product_code=6), [("likely", "station.match-vendor")]),
        (Found(1, vendor_id=0x999, product_code=5), []),
        # Shows nothing of itself.
        (Found(1, vendor_id=0, product_code=0), [("possible", "station.match-bus")]),
        (Found(1), [("possible", "station.match-bus")]),
    ],
)
def test_vendor_and_product(
    found: Found, fits: list[tuple[str, str]], profile: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    identity = profile.identity.model_copy(update={"vendor_id": 0x2FE, "product_code": 5})
    known = profile.model_copy(update={"identity": identity})
    monkeypatch.setattr(matching, "load_all", lambda: {"sample": known})
    matches = matching.match_profiles("mlink", found)
    assert [(m.confidence, m.why.code) for m in matches] == fits
