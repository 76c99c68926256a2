"""Causes from facts, against the AL status codes of ETG.1020 and the meaning of the registers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from drivers.doctor import diagnosis
from drivers.doctor.diagnosis import AL_CAUSES, Fact, catalogue, diagnose, fact_texts
from drivers.doctor.evidence import Counters, Evidence, SyncManagerState
from drivers.doctor.page import PAGE, text
from drivers.ethercat.wire.al_status import al_status_text

RULES = ("diagnosis", "can_diagnosis")
MANAGERS = (
    SyncManagerState(2, 0x1200, 8, 0x64, True, 8),
    SyncManagerState(3, 0x1500, 6, 0x20, True, 6),
)


@pytest.mark.parametrize(
    ("evidence", "cause"),
    [
        (Evidence(1, answers=False), "station_silent"),
        (Evidence(1, al=0x12, al_code=0x16), "mailbox_setup"),
        (Evidence(1, al=0x12, al_code=0x17, managers=MANAGERS, outputs=9, planned_outputs=8),
         "outputs_size"),
        (Evidence(1, al=0x12, al_code=0x1E, managers=MANAGERS, inputs=7), "inputs_size"),
        (Evidence(1, al=0x12, al_code=0x1D, mandatory=(0x1600,), assigned=(0x1601,)),
         "mandatory_missing"),
        (Evidence(1, al=2, refused_key="1C12:00"), "assignment_locked"),
        (Evidence(1, al=2, refused_key="1600:00"), "mapping_locked"),
        (Evidence(1, al=2, refused_key="6060:00", from_file=True), "init_command_refused"),
        (Evidence(1, al=0x14, al_code=0x1B, watchdog_expired=True), "watchdog_expired"),
        (Evidence(1, al=0x14, al_code=0x1B, sync0_pending=True), "sync0_missing"),
        (Evidence(1, al=0x12, al_code=0x1, activate=0x300, planned_activate=0x330),
         "clock_mode_wrong"),
        (Evidence(1, al=0x14, al_code=0x1, activate=0x300, planned_activate=0x300,
                  sm_counters=Counters(missed=3)), "sync0_unsteady"),
        (Evidence(1, al=0x12, al_code=0x1, eeprom_busy=True), "eeprom_busy"),
        (Evidence(1, al=0x12, al_code=0x1D, revision=2, known_revision=3), "other_revision"),
        (Evidence(1, al=0x12, al_code=0x1D, product=2, known_product=3), "other_product"),
        (Evidence(1, al=2, alias=5, aliases=(0, 5)), "duplicate_alias"),
        (Evidence(1, al=0x14, drive_error=0x7305), "drive_fault"),
        (Evidence(1, al=4, port_errors=17), "cable"),
        (Evidence(1, al=4, wkc=2, planned_wkc=3), "no_outputs"),
        (Evidence(1, al=2, al_code=0x8001), "makers_code"),
        (Evidence(1, al=2, timed_out=True), "too_slow"),
        (Evidence(1, al=2), "unknown"),
    ],
)  # fmt: skip
def test_first_cause(evidence: Evidence, cause: str) -> None:
    found = diagnose(evidence)
    assert found[0].code == cause
    assert found[0].facts
    assert found[0].text.remedy


def test_a_healthy_station_accuses_nobody() -> None:
    """No sign: the words are then those for no reason."""
    well = Evidence(1, al=8, managers=MANAGERS, outputs=8, inputs=6, planned_outputs=8,
                    planned_inputs=6, activate=0x300, planned_activate=0x300)  # fmt: skip
    assert [c.code for c in diagnose(well)] == ["unknown"]


def test_every_code_of_the_standard_has_a_cause() -> None:
    """Those of a refusal on the way up; the others concern files, latches and mailboxes."""
    others = {0x0000, 0x0001, 0x0007, 0x000E, 0x0011, 0x0012, 0x0013, 0x0021, 0x0022, 0x0023,
              0x0031, 0x0061, 0x00F0, *range(0x0041, 0x0050)}  # fmt: skip
    known = {c for c in range(0x100) if al_status_text(c).code != al_status_text(0x99).code}
    assert known - others == set(AL_CAUSES)


def test_every_text_is_there_in_both_languages() -> None:
    for cause in catalogue().values():
        assert re.search(r"[一-鿿]", cause.zh)
        assert re.search(r"[一-鿿]", cause.zh_remedy)
        assert cause.title
        assert cause.shows
    assert set(AL_CAUSES.values()) <= set(catalogue())


def test_the_page_is_that_of_the_catalogue() -> None:
    assert PAGE.read_text("utf-8") == text(), "write it again: python -m drivers.doctor.page"


def test_every_fact_has_a_name_in_both_languages() -> None:
    """Facts are made where the rules are; nobody reads ``al_status = 27`` on the page."""
    folder = Path(diagnosis.__file__).parent
    sources = "".join((folder / f"{name}.py").read_text("utf-8") for name in RULES)
    made = set(re.findall(r'Fact\(\s*"(\w+)"', sources))
    made |= {f"{name}_sm{number}" for name in ("assigned_bytes", "length") for number in (2, 3)}
    made |= {"vendor", "product"}
    assert made == set(fact_texts())
    assert all(re.search("[一-鿿]|（", each.zh) for each in fact_texts().values())


def test_codes_are_shown_as_manuals_print_them() -> None:
    """ETG.1020 prints AL status codes in hexadecimal; times and counts are decimal."""
    watchdog = Fact("al_status", 0x1B, 0)
    assert (watchdog.shown, watchdog.shown_expected) == ("0x001B", "0x0000")
    assert Fact("vendor", 0xA2B).shown == "0x00000A2B"
    assert (Fact("sync0_cycle_ns", 1_000_000).shown, Fact("alias", 7).shown_expected) == (
        "1000000",
        None,
    )
    assert Fact("refused_object", "1C12:00").shown == "1C12:00"
