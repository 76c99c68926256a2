"""Diagnosis of a CANopen node from facts, the most likely cause first: pure.

Weights as in `drivers.doctor.diagnosis`. Sources: CiA 301 v4.2.0 (states, error control, emergency
codes table 26, PDO parameters), CiA 402-2 clause 8.4.2 (bit 9 "remote" of 6041h).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from drivers.doctor.can_evidence import CanEvidence
from drivers.doctor.diagnosis import Cause, Fact, Sign, ranked

_STOPPED, _OPERATIONAL, _PREOPERATIONAL = 4, 5, 127
_SYNC, _IDENTIFIER = 0x80, 0x7FF
_REMOTE, _SERVO = 0x0200, 402
_LOCAL_CONTROL = 0x08000021
_BOOTS_OF_A_LOOP = 3

EMERGENCY_CAUSES: dict[int, str] = {
    0x8110: "can_overrun", 0x8120: "can_error_passive", 0x8130: "can_master_not_heard",
    0x8140: "can_node_bus_off", 0x8150: "can_cob_id_collision", 0x8210: "can_pdo_length",
    0x8220: "can_pdo_length", 0x8240: "can_sync_wrong", 0x8250: "can_outputs_late",
}  # fmt: skip
"""Emergency codes of the network (CiA 301 table 26); all others are the drive's own."""

REFUSAL_CAUSES: dict[str, str] = {
    "canopen.node-bus-number-under": "can_own_number",
    "canopen.pdos-every-ms-load": "can_bus_full",
    "canopen.cycle-ms-too-short": "can_cycle_short",
}


def diagnose(evidence: CanEvidence) -> tuple[Cause, ...]:
    """Return the matching causes, the most likely first; empty for a node in Operational."""
    found = ranked(_signs(evidence))
    if found or _well(evidence):
        return found
    shown = -1 if evidence.state is None else evidence.state
    return (Cause("can_unknown", 0, (Fact("nmt_state", shown, _OPERATIONAL),)),)


def _well(e: CanEvidence) -> bool:
    """Return whether it is in Operational; process data show this without error control."""
    if e.refused:
        return False
    return e.state == _OPERATIONAL or (e.state is None and e.pdos_wanted > 0 and not e.pdos_silent)


def _signs(e: CanEvidence) -> Iterator[Sign]:
    yield from _of_the_bus(e)
    if not e.bus.open or (e.bus.received == 0 and _errors(e)):
        return
    if e.answers == 0:
        yield from _silent(e)
        return
    for rule in _RULES:
        yield from rule(e)


def _errors(e: CanEvidence) -> bool:
    bus = e.bus
    return bool(bus.acknowledge_errors or bus.protocol_errors or bus.error_passive or bus.not_sent)


def _of_the_bus(e: CanEvidence) -> Iterator[Sign]:
    bus = e.bus
    if bus.bus_off:
        yield "can_bus_off", 9, Fact("bus_off", 1, 0)
    elif not bus.open:
        yield "can_adapter_gone", 9, Fact("adapter_open", 0, 1)
    if bus.received == 0:
        if bus.acknowledge_errors:
            fact = Fact("acknowledge_errors", bus.acknowledge_errors, 0)
            yield "can_no_acknowledge", 8, fact
        elif bus.protocol_errors:
            yield "can_other_bit_rate", 8, Fact("protocol_errors", bus.protocol_errors, 0)
            yield "can_other_bit_rate", 0, Fact("bit_rate", bus.bitrate)
        elif bus.error_passive:
            # The adapter reports nothing more. An adapter alone on the bus stays error passive (ISO
            # 11898-1 clause 8.2); with others at another bit rate it goes bus-off.
            yield "can_no_acknowledge", 4, Fact("error_passive", bus.error_passive, 0)
            yield "can_other_bit_rate", 2, Fact("error_passive", bus.error_passive, 0)
        elif bus.not_sent:
            yield "can_no_acknowledge", 4, Fact("frames_not_sent", bus.not_sent, 0)
    elif bus.acknowledge_errors or bus.protocol_errors:
        count = bus.acknowledge_errors + bus.protocol_errors
        yield "can_wiring", 2, Fact("error_frames", count, 0)


def _silent(e: CanEvidence) -> Iterator[Sign]:
    for other in e.same_product:
        yield "can_other_node_id", 9, Fact("same_product_at_node", other, e.node)
    if e.boots >= _BOOTS_OF_A_LOOP:
        yield "can_boot_loop", 9, Fact("boot_ups", e.boots, 1)
    elif e.heard and e.state == _STOPPED and e.alive:
        yield "can_stopped", 8, Fact("nmt_state", _STOPPED, _OPERATIONAL)
    elif e.heard and e.alive and e.period_s is not None:
        yield "can_sdo_silent", 8, Fact("answers", 0, 1)
    elif e.heard and not e.alive:
        code = "can_guarding_lost" if e.guarded else "can_heartbeat_lost"
        yield code, 7, Fact("silent_s", f"{e.silent_s or 0:.1f}")
    else:
        yield "can_node_silent", 5, Fact("answers", 0, 1)
        yield "can_node_silent", 0, Fact("other_nodes", len(e.others))


def _numbers(e: CanEvidence) -> Iterator[Sign]:
    if e.answers > 1:
        yield "can_duplicate_node", 9, Fact("answers", e.answers, 1)
    if e.toggle_repeated:
        yield "can_duplicate_node", 3, Fact("guarding_toggle_repeated", 1, 0)
    if e.foreign_master:
        yield "can_other_master", 4, Fact("requests_of_others", 1, 0)
    for cob_id, other in e.collisions:
        yield "can_cob_id_collision", 6, Fact("shared_identifier", f"{cob_id:03X}h")
        yield "can_cob_id_collision", 0, Fact("other_node", other)


def _refusals(e: CanEvidence) -> Iterator[Sign]:
    if cause := REFUSAL_CAUSES.get(e.refused):
        yield cause, 8, Fact("refusal", e.refused)
    key = e.refused_key
    if e.refused_code == _LOCAL_CONTROL:
        yield "can_local_control", 8, Fact("abort_code", f"{_LOCAL_CONTROL:08X}h")
    elif key.startswith(("16", "17", "1A", "1B")):
        yield "can_mapping_refused", 6, Fact("refused_object", key)
    elif key.startswith(("14", "15", "18", "19")):
        yield "can_pdo_id_refused", 6, Fact("refused_object", key)
    if e.timed_out:
        yield "can_sdo_slow", 4, Fact("time_out_s", f"{e.timeout_s:g}")


def _error_control(e: CanEvidence) -> Iterator[Sign]:
    if e.boots >= _BOOTS_OF_A_LOOP:
        yield "can_boot_loop", 7, Fact("boot_ups", e.boots, 1)
    if e.heard and not e.alive:
        code = "can_guarding_lost" if e.guarded else "can_heartbeat_lost"
        yield code, 5, Fact("silent_s", f"{e.silent_s or 0:.1f}")
    if e.state == _STOPPED:
        yield "can_stopped", 7, Fact("nmt_state", e.state, _OPERATIONAL)
    elif e.state == _PREOPERATIONAL and e.started:
        yield "can_stays_preoperational", 3, Fact("nmt_state", e.state, _OPERATIONAL)
    elif e.state is None and not e.started and not e.refused:
        yield "can_not_started", 1, Fact("exchange_started", 0, 1)
    elif e.state == _PREOPERATIONAL and not e.refused:
        yield "can_not_started", 1, Fact("nmt_state", e.state, _OPERATIONAL)


def _emergencies(e: CanEvidence) -> Iterator[Sign]:
    code = e.emergency
    if code and e.emergency_open:
        fact = Fact("emergency", f"{code:04X}h", "0000h")
        yield EMERGENCY_CAUSES.get(code, "can_drive_fault"), 4, fact
    if e.drive_error and EMERGENCY_CAUSES.get(e.drive_error) is None:
        yield "can_drive_fault", 2, Fact("error_code_603F", f"{e.drive_error:04X}h", "0000h")


def _process_data(e: CanEvidence) -> Iterator[Sign]:
    if e.sync_cob is not None and e.sync_cob & _IDENTIFIER != _SYNC:
        yield "can_sync_wrong", 6, Fact("sync_1005", f"{e.sync_cob:08X}h", "00000080h")
    if e.bus.other_sync:
        yield "can_two_sync", 5, Fact("sync_of_others", 1, 0)
    if e.started and e.pdos_silent:
        for cob_id in e.pdos_silent:
            yield "can_sync_missing", 2, Fact("pdo_silent", f"{cob_id:03X}h")


def _identity(e: CanEvidence) -> Iterator[Sign]:
    if e.device_type is not None and e.device_type & 0xFFFF != _SERVO:
        yield "can_no_drive", 5, Fact("device_profile_1000", e.device_type & 0xFFFF, _SERVO)
    for name, held, known in (
        ("vendor", e.vendor, e.known_vendor),
        ("product", e.product, e.known_product),
    ):
        if held and known is not None and held != known:
            yield "can_other_product", 7, Fact(name, held, known)
    refused = bool(e.refused_key)
    if e.revision and e.known_revision is not None and e.revision != e.known_revision and refused:
        yield "can_other_revision", 7, Fact("revision", e.revision, e.known_revision)
    known = e.status_word is not None and not e.own_status_word
    if known and not (e.status_word or 0) & _REMOTE:
        fact = Fact("status_word_6041", f"{e.status_word:04X}h", "bit 9 = 1")
        yield "can_local_control", 4, fact


_RULES: tuple[Callable[[CanEvidence], Iterator[Sign]], ...] = (
    _numbers,
    _refusals,
    _error_control,
    _emergencies,
    _process_data,
    _identity,
)
