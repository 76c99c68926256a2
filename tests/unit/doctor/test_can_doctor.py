"""Causes of a CANopen node from facts, against CiA 301 (states, emergency codes) and CiA 402."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivers.doctor.can_diagnosis import EMERGENCY_CAUSES, REFUSAL_CAUSES, diagnose
from drivers.doctor.can_evidence import BusFacts, CanEvidence
from drivers.doctor.diagnosis import catalogue

BUS = BusFacts(received=20, bitrate=1_000_000)
WELL = CanEvidence(
    5, bus=BUS, state=5, heard=True, period_s=0.1, started=True, pdos_wanted=1, sync_cob=0x80,
    status_word=0x0250, device_type=0x20192,
)  # fmt: skip
QUIET = replace(WELL, answers=0, heard=False, state=None, started=False, period_s=None)


@pytest.mark.parametrize(
    ("evidence", "cause"),
    [
        (replace(WELL, bus=replace(BUS, open=False)), "can_adapter_gone"),
        (replace(WELL, bus=replace(BUS, open=False, bus_off=True)), "can_bus_off"),
        (replace(QUIET, bus=BusFacts(acknowledge_errors=3)), "can_no_acknowledge"),
        (replace(QUIET, bus=BusFacts(not_sent=3)), "can_no_acknowledge"),
        (replace(QUIET, bus=BusFacts(protocol_errors=3)), "can_other_bit_rate"),
        (replace(WELL, bus=replace(BUS, protocol_errors=3)), "can_wiring"),
        (QUIET, "can_node_silent"),
        (replace(QUIET, same_product=(9,), others=(9,)), "can_other_node_id"),
        (replace(QUIET, heard=True, state=4, period_s=0.1), "can_stopped"),
        (replace(QUIET, heard=True, state=127, period_s=0.1), "can_sdo_silent"),
        (replace(QUIET, heard=True, alive=False, silent_s=2.0), "can_heartbeat_lost"),
        (replace(QUIET, heard=True, alive=False, guarded=True), "can_guarding_lost"),
        (replace(QUIET, boots=4, heard=True), "can_boot_loop"),
        (replace(WELL, answers=2), "can_duplicate_node"),
        (replace(WELL, state=127), "can_stays_preoperational"),
        (replace(WELL, state=127, started=False, pdos_wanted=0), "can_not_started"),
        (replace(WELL, refused="x", refused_key="1A00:00"), "can_mapping_refused"),
        (replace(WELL, refused="x", refused_key="1800:01"), "can_pdo_id_refused"),
        (
            replace(WELL, refused="x", refused_key="1800:01", refused_code=0x08000021),
            "can_local_control",
        ),
        (replace(WELL, refused="x", timed_out=True), "can_sdo_slow"),
        (replace(WELL, collisions=((0x185, 6),)), "can_cob_id_collision"),
        (replace(WELL, sync_cob=0x90), "can_sync_wrong"),
        (replace(WELL, bus=replace(BUS, other_sync=True)), "can_two_sync"),
        (replace(WELL, pdos_silent=(0x185,)), "can_sync_missing"),
        (replace(WELL, status_word=0x0050), "can_local_control"),
        (replace(WELL, emergency=0x3210, emergency_open=True), "can_drive_fault"),
        (replace(WELL, refused="x"), "can_unknown"),
    ],
)
def test_first_cause(evidence: CanEvidence, cause: str) -> None:
    found = diagnose(evidence)
    assert found[0].code == cause
    assert found[0].facts
    assert found[0].text.bus == "canopen"


def test_a_healthy_node_accuses_nobody() -> None:
    assert diagnose(WELL) == ()
    # Neither heartbeat nor guarding: its process data say that it is in Operational.
    assert diagnose(replace(WELL, state=None, heard=False, period_s=None)) == ()


def test_an_emergency_that_was_taken_back_is_no_cause() -> None:
    assert diagnose(replace(WELL, emergency=0x8130, emergency_open=False)) == ()


def test_a_status_word_of_the_makers_own_says_nothing_of_local_control() -> None:
    assert diagnose(replace(WELL, status_word=0x0400, own_status_word=True)) == ()


def test_the_revision_matters_only_where_something_was_refused() -> None:
    other = replace(WELL, revision=2, known_revision=3)
    assert diagnose(other) == ()
    assert diagnose(replace(other, refused="x", refused_key="1600:00"))[0].code == (
        "can_other_revision"
    )


def test_every_cause_of_a_table_is_in_the_catalogue() -> None:
    assert {*EMERGENCY_CAUSES.values(), *REFUSAL_CAUSES.values()} <= set(catalogue())
    # CiA 301 v4.2.0 table 26: the codes of 81xxh and 82xxh that name one cause.
    assert set(EMERGENCY_CAUSES) == {
        0x8110, 0x8120, 0x8130, 0x8140, 0x8150, 0x8210, 0x8220, 0x8240, 0x8250
    }  # fmt: skip
