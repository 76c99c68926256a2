"""CiA 402 states, option codes, halts and faults as manual 004 prints them."""

from __future__ import annotations

import pytest

from drivers.virtual.firmware.cia402.states import Command, State, decode, next_state
from drivers.virtual.mechanics import FrictionSpec, MechanicsSpec, SupplySpec

from .servo_bench import REV, TURN, Bench, rigid

SOD, READY, ON, OPERATING, QUICK, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08


def state(bench: Bench) -> int:
    return bench.status & 0x6F


def run_at(bench: Bench, rev_per_s: float = 20.0) -> None:
    bench.enable(3)
    bench.set("60FF:00", round(rev_per_s * REV))
    bench.run(0.8)
    assert bench.get("606C:00") == pytest.approx(rev_per_s * REV, rel=0.01)


@pytest.mark.parametrize(
    ("word", "command"),
    [
        (0x06, Command.SHUTDOWN),
        (0x0E, Command.SHUTDOWN),
        (0x07, Command.SWITCH_ON),
        (0x0F, Command.ENABLE),
        (0x00, Command.DISABLE_VOLTAGE),
        (0x0D, Command.DISABLE_VOLTAGE),
        (0x02, Command.QUICK_STOP),
        (0x0B, Command.QUICK_STOP),
    ],
)
def test_command_coding_of_table_45(word: int, command: Command) -> None:
    assert decode(word) is command


@pytest.mark.parametrize(
    ("start", "command", "end"),
    [
        (State.SWITCH_ON_DISABLED, Command.SHUTDOWN, State.READY),
        (State.SWITCH_ON_DISABLED, Command.ENABLE, State.SWITCH_ON_DISABLED),
        (State.READY, Command.SWITCH_ON, State.SWITCHED_ON),
        (State.READY, Command.QUICK_STOP, State.SWITCH_ON_DISABLED),
        (State.SWITCHED_ON, Command.SHUTDOWN, State.READY),
        (State.SWITCHED_ON, Command.ENABLE, State.OPERATION_ENABLED),
        (State.OPERATION_ENABLED, Command.SWITCH_ON, State.SWITCHED_ON),
        (State.OPERATION_ENABLED, Command.QUICK_STOP, State.QUICK_STOP_ACTIVE),
        (State.FAULT, Command.SHUTDOWN, State.FAULT),
    ],
)
def test_transitions_of_table_44(start: State, command: Command, end: State) -> None:
    assert next_state(start, command) is end


def test_walk_through_the_states(bench) -> None:
    b = bench()
    assert state(b) == SOD
    for word, expected in (
        (0x0F, SOD), (0x06, READY), (0x07, ON), (0x0F, OPERATING), (0x07, ON), (0x06, READY),
        (0x0F, OPERATING), (0x06, READY), (0x00, SOD), (0x06, READY), (0x07, ON), (0x02, SOD),
    ):  # fmt: skip
        b.set("6040:00", word)
        b.run(1e-3)
        assert state(b) == expected, hex(word)
    assert b.status & 0x0210 == 0x0210  # voltage enabled, remote


def test_disable_voltage_coasts(bench) -> None:
    b = bench()
    run_at(b)
    b.set("6040:00", 0)
    assert state(b) == SOD
    before = b.get("6064:00")
    b.run(0.5)
    assert b.get("6064:00") - before == pytest.approx(10 * REV, rel=0.01)


@pytest.mark.parametrize("option", [1, 2, 5, 6])
def test_quick_stop_on_a_ramp(bench, option: int) -> None:
    """Braking from 20 rev/s at 50 (6084h) or 100 rev/s² (6085h): v²/2a = 4 or 2 revolutions."""
    b = bench()
    b.set("6085:00", 100 * REV)
    b.set("605A:00", option)
    run_at(b)
    start = b.get("6064:00")
    b.set("6040:00", 0x02)
    assert state(b) == QUICK
    time_s = b.run_until(lambda: abs(b.get("606C:00")) < REV // 100, 1.0)
    braking = 50 if option in (1, 5) else 100
    assert time_s == pytest.approx(20 / braking, abs=0.02)
    b.run(0.2)
    assert (b.get("6064:00") - start) / REV == pytest.approx(20**2 / (2 * braking), abs=0.1)
    assert state(b) == (SOD if option <= 2 else QUICK)
    if option >= 5:
        b.set("6040:00", 0x0F)  # transition 16
        assert state(b) == OPERATING


@pytest.mark.parametrize(("option", "torque_nm"), [(3, 0.2 * 1.27), (4, 3.0 * 1.27)])
def test_quick_stop_by_current_and_by_voltage(bench, option: int, torque_nm: float) -> None:
    """2002h:05 is 20 % of rated; the voltage limit gives all the drive has (at most 300 %)."""
    b = bench()
    b.set("605A:00", option)
    run_at(b)
    b.set("6040:00", 0x02)
    time_s = b.run_until(lambda: state(b) == SOD, 1.0, 2e-4)
    rotor = 5e-5
    expected = 20 * TURN * rotor / torque_nm
    # The torque fades out below the brake speed threshold of 10 rpm and builds up in 1/(2π·1 kHz).
    assert expected <= time_s < expected * 1.2 + 0.003


def test_quick_stop_option_0_coasts(bench) -> None:
    b = bench()
    b.set("605A:00", 0)
    run_at(b)
    b.set("6040:00", 0x02)
    assert state(b) == SOD
    b.run(0.2)
    assert b.get("606C:00") == pytest.approx(20 * REV, rel=0.01)


@pytest.mark.parametrize(("word", "key", "end"), [(6, "605B:00", READY), (7, "605C:00", ON)])
@pytest.mark.parametrize("option", [0, 1])
def test_shutdown_and_disable_operation(bench, word: int, key: str, end: int, option: int) -> None:
    b = bench()
    b.set(key, option)
    run_at(b)
    b.set("6040:00", word)
    assert state(b) == (OPERATING if option else end)
    b.run(0.2)
    if option == 0:
        assert b.get("606C:00") == pytest.approx(20 * REV, rel=0.01)
    b.run(0.3)
    assert state(b) == end
    if option == 1:
        # Braking ends at the brake speed threshold 2002h:06 of 10 rpm; then the axis is free.
        assert abs(b.get("606C:00")) < 10 / 60 * REV


@pytest.mark.parametrize(("option", "braking"), [(1, 50), (2, 100)])
def test_halt_stays_enabled_and_goes_on(bench, option: int, braking: int) -> None:
    b = bench()
    b.set("6085:00", 100 * REV)
    b.set("605D:00", option)
    run_at(b)
    b.set("6040:00", 0x010F)
    assert not b.status & 0x400
    time_s = b.run_until(lambda: abs(b.get("606C:00")) < REV // 100, 1.0)
    assert time_s == pytest.approx(20 / braking, abs=0.02)
    b.run(0.05)
    assert state(b) == OPERATING
    assert b.status & 0x400
    b.set("6040:00", 0x000F)
    b.run(0.6)
    assert b.get("606C:00") == pytest.approx(20 * REV, rel=0.01)


def test_halt_in_a_move_pauses_it(bench) -> None:
    b = bench()
    b.enable(1)
    b.set("607A:00", 20 * REV)
    b.set("6040:00", 0x1F)
    b.run(0.7)
    b.set("6040:00", 0x11F)
    b.run(0.6)
    held = b.get("6064:00")
    b.run(0.2)
    assert abs(b.get("6064:00") - held) < 20
    assert held < 19 * REV
    b.set("6040:00", 0x1F)
    b.run(2.5)
    assert abs(b.get("6064:00") - 20 * REV) < 182


def test_halt_option_0_coasts(bench) -> None:
    b = bench()
    b.set("605D:00", 0)
    run_at(b)
    b.set("6040:00", 0x010F)
    b.run(0.3)
    assert b.get("606C:00") == pytest.approx(20 * REV, rel=0.01)
    assert state(b) == OPERATING


@pytest.mark.parametrize(
    ("name", "bit", "code"),
    [
        ("over_current", 0, 0x2300), ("under_voltage", 1, 0x3220), ("locked_rotor", 2, 0x7121),
        ("power_stage", 3, 0x5400), ("overload", 4, 0x3230), ("position_limit", 5, 0),
        ("sensor", 6, 0), ("memory", 7, 0), ("over_temperature", 8, 0x4210),
        ("over_voltage", 9, 0x3210), ("over_speed", 10, 0x8400), ("speed_error", 11, 0x8401),
        ("watchdog", 12, 0x7500),
    ],
)  # fmt: skip
def test_fault_bits_and_codes_of_table_70(bench, name: str, bit: int, code: int) -> None:
    b = bench()
    b.enable(1)
    b.servo.inject(name)
    assert state(b) == FAULT
    assert b.get("200B:0B") == 1 << bit
    assert b.get("603F:00") == code
    (emergency,) = b.servo.take_emergencies()
    assert emergency[0] == (code or 0xFF00)
    b.set("6040:00", 0x0F)
    assert state(b) == FAULT
    b.set("6040:00", 0x80)
    assert state(b) == SOD
    assert b.get("603F:00") == b.get("200B:0B") == 0


def test_fault_by_code(bench) -> None:
    b = bench()
    b.servo.inject("0x3230")
    assert b.get("200B:0B") == 1 << 4
    with pytest.raises(ValueError, match="0x1234"):
        b.servo.inject("0x1234")
    with pytest.raises(ValueError, match="gremlin"):
        b.servo.inject("gremlin")


@pytest.mark.parametrize(("option", "braking"), [(1, 50), (2, 100)])
def test_fault_reaction_ramps(bench, option: int, braking: int) -> None:
    b = bench()
    b.set("6085:00", 100 * REV)
    b.set("605E:00", option)
    run_at(b)
    b.servo.inject("watchdog")
    assert state(b) == 0x0F
    time_s = b.run_until(lambda: state(b) == FAULT, 1.0)
    assert time_s == pytest.approx(20 / braking, abs=0.02)


def test_fixed_faults_disable_whatever_605e_says(bench) -> None:
    b = bench()
    b.set("605E:00", 1)
    run_at(b)
    b.servo.inject("power_stage")
    assert state(b) == FAULT
    b.run(0.2)
    assert b.get("606C:00") == pytest.approx(20 * REV, rel=0.01)


def test_communication_loss_matters_only_with_the_servo_on(bench) -> None:
    b = bench()
    b.servo.communication_lost("watchdog")
    assert state(b) == SOD
    b.enable(1)
    b.servo.communication_lost("watchdog")
    assert state(b) == FAULT
    assert b.get("603F:00") == 0x7500


def test_retry_returns_to_operation(bench) -> None:
    b = bench()
    b.set("200B:07", 1)
    b.set("200B:08", 500)
    b.apply()
    b.enable(1)
    b.servo.inject("overload")
    b.run(0.4)
    assert state(b) == FAULT
    b.run(0.2)
    assert state(b) == OPERATING


def test_reset_is_refused_while_the_cause_lasts(bench) -> None:
    b = bench()
    b.set("200B:01", 0x02)
    b.apply()
    b.servo.inject("supply_v", 9.0)
    b.run(0.01)
    assert b.get("603F:00") == 0x3220
    b.set("6040:00", 0x80)
    assert state(b) == FAULT
    b.servo.inject("supply_v", 48.0)
    b.run(0.01)
    b.set("6040:00", 0)
    b.set("6040:00", 0x80)
    assert state(b) == SOD


def test_fault_reset_needs_a_rising_edge(bench) -> None:
    b = bench()
    b.set("6040:00", 0x80)
    b.servo.inject("overload")
    b.set("6040:00", 0x8F)
    assert state(b) == FAULT
    b.set("6040:00", 0x0F)
    b.set("6040:00", 0x8F)
    assert state(b) == SOD


def test_over_temperature_warns_20_degrees_early(bench) -> None:
    b = bench()
    b.set("200B:01", 0x10)
    b.apply()
    b.servo.inject("ambient_c", 64.0)
    b.servo.inject("temperature_c", 64.0)
    b.run(0.01)
    assert not b.status & 0x80
    b.servo.inject("temperature_c", 66.0)
    b.run(0.001)
    assert b.status & 0x80
    assert state(b) == SOD
    b.servo.inject("temperature_c", 86.0)
    b.run(0.001)
    assert b.get("603F:00") == 0x4210


def test_over_voltage_by_regeneration_and_how_the_resistor_prevents_it(bench) -> None:
    """½·J·ω² = 10 J into 1 mF from 48 V would give 149 V; the trip is at 56 + 1 V."""
    spec = MechanicsSpec(
        motor={"inertia_kgm2": 2e-4, "rated_torque_nm": 1.27, "rated_speed_rpm": 3000},
        supply=SupplySpec(sinks=False),
    )
    for braking_resistor in (False, True):
        b = bench(spec)
        b.set("200B:01", 8 if braking_resistor else 0)
        b.set("6083:00", 500 * REV)
        # A 25 Ω resistor takes 56²/25 = 125 W; 10 J in 0.5 s stay below that.
        b.set("6084:00", 100 * REV)
        b.apply()
        run_at(b, 48.0)
        b.set("60FF:00", 0)
        b.run(0.6)
        assert (b.get("603F:00") == 0x3210) is not braking_resistor
        if braking_resistor:
            assert b.get("6079:00") <= 57_000


def test_locked_rotor(bench) -> None:
    """Current above rated and no movement for 200Bh:06 (004:4742-4760)."""
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    b.set("200B:01", 4)
    b.set("200B:06", 300)
    b.set("200B:0D", 100000)
    b.apply()
    b.enable(1)
    b.set("607A:00", REV)
    b.set("6040:00", 0x1F)
    b.run_until(lambda: abs(b.get("6077:00")) > 1000, 1.0)
    time_s = b.run_until(lambda: state(b) == FAULT, 1.0)
    assert time_s == pytest.approx(0.3, abs=0.002)
    assert b.get("603F:00") == 0x7121


def test_over_speed_from_an_outside_torque(bench) -> None:
    """Gravity 0.05 Nm on a free axis: 3600 rpm after ω·J/T."""
    b = bench(rigid(friction=FrictionSpec(gravity_nm=0.05)))
    time_s = b.run_until(lambda: b.get("603F:00") == 0x8400, 1.0)
    assert time_s == pytest.approx(60 * TURN * 5e-5 / 0.05, rel=0.01)


def test_speed_error_when_the_load_is_too_heavy(bench) -> None:
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    b.enable(3)
    b.set("6083:00", 2000 * REV)
    b.set("60FF:00", 50 * REV)
    b.run(0.1)
    assert b.get("603F:00") == 0x8401


def test_over_current_threshold_is_a_phase_peak(bench) -> None:
    """Peak = √2·T/Kt; the shaft is clamped so that the torque lasts."""
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    kt = b.get("2001:05") / 1000
    amperes = int(1.414214 * 1.27 / kt) + 1  # the first whole ampere above rated torque
    b.set("200B:01", 1)
    b.set("200B:02", amperes)
    b.apply()
    b.enable(4)
    b.set("6087:00", 100_000)
    b.set("6071:00", 950)
    b.run(0.02)
    assert b.get("603F:00") == 0
    b.set("6071:00", 1150)
    b.run(0.02)
    assert b.get("603F:00") == 0x2300


def test_overload_after_its_time_window(bench) -> None:
    b = bench(rigid(friction=FrictionSpec(coulomb_nm=10.0)))
    b.set("2042:01", 1)
    b.set("2042:02", 1200)
    b.set("2042:03", 250)
    b.apply()
    b.enable(4)
    b.set("6087:00", 1_000_000)
    b.set("6071:00", 1500)
    time_s = b.run_until(lambda: b.get("603F:00") == 0x3230, 1.0)
    assert time_s == pytest.approx(0.25, abs=0.004)


def test_encoder_loss(bench) -> None:
    b = bench()
    run_at(b)
    b.servo.inject("encoder_loss")
    b.run(1e-3)
    assert state(b) == FAULT
    assert b.get("200B:0B") == 1 << 6
    b.set("6040:00", 0x80)
    assert state(b) == FAULT
    b.servo.inject("encoder_loss", 0)
    b.set("6040:00", 0)
    b.set("6040:00", 0x80)
    assert state(b) == SOD


def test_holding_brake_keeps_a_vertical_axis(bench) -> None:
    b = bench(rigid(friction=FrictionSpec(gravity_nm=0.5)))
    b.set("2108:01", 1)
    b.apply()
    b.run(1e-3)
    before = b.get("6064:00")
    b.run(0.5)
    assert b.get("6064:00") == before


@pytest.mark.parametrize("mode", [1, 4, 8, 9, 10])
def test_quick_stop_ramp_from_every_mode(bench, mode: int) -> None:
    """About 5 rev/s down at 100 rev/s² takes 50 ms whatever loop was closed before."""
    b = bench()
    b.set("6085:00", 100 * REV)
    b.set("6087:00", 100000)
    b.enable(mode)
    if mode == 1:
        b.set("6081:00", 5 * REV)
        b.set("607A:00", 50 * REV)
        b.set("6040:00", 0x1F)
        b.run(0.3)
    elif mode == 8:
        for cycle in range(1, 301):
            b.set("607A:00", cycle * 5 * REV // 1000)
            b.run(1e-3)
    elif mode == 9:
        b.set("60FF:00", 5 * REV)
        b.run(0.3)
    else:
        b.set("6071:00", 20)
        b.run_until(lambda: b.get("606C:00") > 5 * REV, 1.0)
    assert b.get("606C:00") / REV == pytest.approx(5, abs=0.2)
    b.set("6040:00", 0x02)
    start = b.get("6064:00")
    b.run_until(lambda: state(b) == SOD, 0.2)
    assert (b.get("6064:00") - start) / REV == pytest.approx(5**2 / 200, abs=0.06)
