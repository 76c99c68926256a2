"""Every transition of the CiA 402 state machine, by every family, over its real wire.

Words and states as printed: 004:3609-3621 (MMS7), 000:1690-1710 (M6-L), 002:2742-2819 (R6L),
001:280-305 (EP3E), 003:298-308 (DS_C, whose status word is its own).
"""

from __future__ import annotations

import pytest

from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, MotorSpec

from .on_wire import ETHERCAT, EVERY, OnWire

SOD, READY, ON, OPERATING, QUICK, FAULT = "sod", "ready", "on", "operating", "quick", "fault"
_STANDARD = {SOD: 0x40, READY: 0x21, ON: 0x23, OPERATING: 0x27, QUICK: 0x07, FAULT: 0x08}
_ECHO = {SOD: 0, READY: 1, ON: 3, OPERATING: 7, QUICK: 0, FAULT: 0x80}
#: 605Ah that keeps the drive in "quick stop active"; the DS_C has no 605Ah.
_STAYING = {"mms7": 6, "m6l": 6, "r6l": 6, "ep3e": 6, "generic402": 6}


def drive(name: str) -> OnWire:
    """A motor alone with enough friction to stop by itself soon."""
    mechanics = MechanicsSpec(
        motor=MotorSpec(inertia_kgm2=5e-5, rated_torque_nm=1.27, rated_speed_rpm=3000),
        friction=FrictionSpec(coulomb_nm=0.05),
    )
    d = OnWire(name, mechanics)
    d.set("6060:00", d.speed_mode)
    return d


def expected(d: OnWire, state: str) -> int:
    if d.drive == "ds_c":
        return _ECHO[state]
    # EP3E shows bit 5 in "switch on disabled", too: 0270h (001:291).
    return 0x60 if (d.drive, state) == ("ep3e", SOD) else _STANDARD[state]


def go(d: OnWire, state: str) -> None:
    """From anywhere but a fault to a state by its usual words."""
    d.command(0)
    d.until(lambda: d.state == expected(d, SOD), 5.0)
    words = {SOD: (), READY: (6,), ON: (6, 7), OPERATING: (6, 7, 15), QUICK: (6, 7, 15, 2)}[state]
    d.command(*words)
    assert d.state == expected(d, state)


@pytest.mark.long(keep=31)
@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize(
    ("number", "start", "word", "end"),
    [
        (2, SOD, 0x06, READY), (3, READY, 0x07, ON), (4, ON, 0x0F, OPERATING),
        (5, OPERATING, 0x07, ON), (6, ON, 0x06, READY), (7, READY, 0x00, SOD),
        (7, READY, 0x02, SOD), (8, OPERATING, 0x06, READY), (9, OPERATING, 0x00, SOD),
        (10, ON, 0x00, SOD), (10, ON, 0x02, SOD),
    ],
)  # fmt: skip
def test_transition(name: str, number: int, start: str, word: int, end: str) -> None:
    d = drive(name)
    go(d, start)
    d.command(word)
    assert d.state == expected(d, end), number


@pytest.mark.parametrize("name", ETHERCAT)
def test_switched_on_is_passed_by_itself(name: str) -> None:
    """3 + 4: 0Fh in "ready to switch on" (note 13, 004:3624; 001:330)."""
    d = drive(name)
    go(d, READY)
    d.command(0x0F)
    assert d.state == expected(d, OPERATING)


@pytest.mark.parametrize("name", sorted(_STAYING))
def test_transitions_11_12_and_16(name: str) -> None:
    d = drive(name)
    d.set("605A:00", _STAYING[name])
    go(d, QUICK)
    d.run(0.1)
    assert d.state == expected(d, QUICK)
    d.command(0x0F)
    assert d.state == expected(d, OPERATING)
    d.command(0x02)
    d.command(0x00)
    assert d.state == expected(d, SOD)


@pytest.mark.parametrize("name", sorted(_STAYING))
def test_transition_12_by_itself(name: str) -> None:
    """Options 0 to 4 leave for "switch on disabled" without a command."""
    d = drive(name)
    d.set("605A:00", 2)
    go(d, OPERATING)
    d.command(0x02)
    d.until(lambda: d.state == expected(d, SOD), 0.5)
    d.command(0x0F)  # not from here
    assert d.state == expected(d, SOD)


def test_emergency_stop_of_the_ds_c_by_word_11() -> None:
    """15 → 11 (003:296)."""
    d = drive("ds_c")
    go(d, OPERATING)
    d.command(0x0B)
    d.until(lambda: d.state == expected(d, SOD), 0.5)
    assert not d.device.axis.powered


@pytest.mark.parametrize("name", EVERY)
def test_fault_and_reset(name: str) -> None:
    """13, 14 and 15: from operation, reset by the rising edge of bit 7 only."""
    d = drive(name)
    go(d, OPERATING)
    d.device.inject("following_error")
    d.until(lambda: d.state == expected(d, FAULT), 1.0)
    for word in (0x06, 0x07, 0x0F, 0x00):
        d.command(word)
        assert d.state == expected(d, FAULT)
    d.command(0x80)
    assert d.state == expected(d, SOD)
    if name != "ds_c":
        # While bit 7 stays 1 no other command acts (001:315, 002:2849, table 45).
        d.command(0x86)
        assert d.state == expected(d, SOD)
    d.command(0x00, 0x06)
    assert d.state == expected(d, READY)


@pytest.mark.parametrize("name", EVERY)
def test_a_fault_whose_cause_is_there_stays(name: str) -> None:
    d = drive(name)
    if name == "mms7":
        d.set_all({"200B:01": 2, "200D:00": 0xAAB555AA})  # under-voltage protection on
    go(d, OPERATING)
    supply_v = d.device.mechanics.supply.voltage_v
    if name == "r6l":
        supply_v = 310.0
    d.device.inject("supply_v", 0.1 * supply_v)
    d.until(lambda: d.state == expected(d, FAULT), 2.0)
    d.command(0x00, 0x80, 0x00)
    assert d.state == expected(d, FAULT)
    d.device.inject("supply_v", supply_v)
    d.run(0.5)
    d.command(0x80, 0x00)
    reset_by_command = {f.code: f.reset_by for f in d.profile.faults}
    code = next(iter(d.device.control.alarms.active), None)
    if code is not None:  # EP3E: phase loss needs the supply switched off (001:1252)
        assert reset_by_command[code] == "power_cycle"
        d.device.power_cycle()
        d.run(0.01)
    assert d.state == expected(d, SOD)


@pytest.mark.parametrize("name", EVERY)
def test_fault_reset_twice_needs_a_new_edge(name: str) -> None:
    d = drive(name)
    d.command(0x80)
    d.device.inject("following_error")
    d.run(0.05)
    assert d.state == expected(d, FAULT)
    d.command(0x80)  # no edge
    assert d.state == expected(d, FAULT)
    d.command(0x00, 0x80)
    assert d.state == expected(d, SOD)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        # 002:2750-2819: 0250h, 0231h, 0233h, 0237h.
        ("r6l", {SOD: 0x0250, READY: 0x0231, ON: 0x0233}),
        # 001:280-296: 0270h, 0231h, 0233h.
        ("ep3e", {SOD: 0x0270, READY: 0x0231, ON: 0x0233}),
    ],
)
def test_whole_status_words(name: str, words: dict[str, int]) -> None:
    d = drive(name)
    for state, word in words.items():
        go(d, state)
        assert d.status & 0x03FF == word


def test_ep3e_needs_a_mode_before_it_is_enabled() -> None:
    """6060h = 0 while enabled is Err88 = FF58h (001:1255, 001:1538)."""
    d = OnWire("ep3e", None)
    d.set("6060:00", 0)
    d.command(6, 7, 15)
    assert d.state == expected(d, FAULT)
    assert d.get("603F:00") == 0xFF58


def test_ds_c_says_speed_zero_and_homed_in_bits_of_its_own() -> None:
    """Bit 10 and bit 8 (003:303-306)."""
    d = drive("ds_c")
    go(d, OPERATING)
    assert d.status & 1 << 10
    d.set_all({"6098:00": 35, "6060:00": 6})
    d.command(0x1F)
    d.run(0.1)
    assert d.status & 1 << 8
