"""Settings of the control loops in SI units.

Every family converts its own gains, filters and thresholds to these records; the loops use no units
such as 0.1 Hz, rigidity levels or ‰.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivers.virtual.mechanics import MechanicsSpec


@dataclass(frozen=True, slots=True)
class Biquad:
    """(z² + a1·z + a2)/(z² + b1·z + b2) at the loop's 50 µs."""

    a1: float
    a2: float
    b1: float
    b2: float


def notch_biquad(centre_hz: float, width_hz: float, depth_db: float, step_s: float) -> Biquad:
    """Return a backward-difference notch: −3 dB width, depth in dB (negative), 004:3494-3499."""
    w = (2 * math.pi * centre_hz * step_s) ** 2
    g = 2 * math.pi * width_hz * step_s
    d = 10 ** (depth_db / 20)
    return Biquad(a1=w + d * g - 2, a2=1 - d * g, b1=w + g - 2, b2=1 - g)


@dataclass(frozen=True, slots=True)
class GainSet:
    """Position gain [1/s], speed gain [Nm/(rad/s)], speed integral gain [Nm/rad]."""

    position_per_s: float
    speed_nms: float
    integral_nm: float


@dataclass(frozen=True, slots=True)
class Switching:
    """Switching to the second gains: ``kind`` is one of SWITCH_*, levels in SI units."""

    kind: int = 0
    level: float = 0.0
    hysteresis: float = 0.0
    delay_s: float = 0.0
    ramp_s: float = 0.001


@dataclass(frozen=True, slots=True)
class Compensation:
    """Torque added by the drive: a bias (gravity), and friction by the direction of the demand."""

    bias_nm: float = 0.0
    positive_nm: float = 0.0
    negative_nm: float = 0.0
    viscous_nms: float = 0.0


@dataclass(frozen=True, slots=True)
class ThirdGains:
    """Gains that hold an axis whose position command has been constant for ``delay_s``."""

    gains: GainSet
    delay_s: float


@dataclass(frozen=True, slots=True)
class SwingFilter:
    """Notch in the position command: (s² + ω²)/(s² + 2ζωs + ω²) with ω of ``frequency_hz``."""

    frequency_hz: float
    damping: float


@dataclass(frozen=True, slots=True)
class QuadrantCompensation:
    """Torque in the new direction after a reversal of the command, over ``angle_rad``."""

    positive_nm: float = 0.0
    negative_nm: float = 0.0
    delay_s: float = 0.0
    filter_s: float = 0.0
    angle_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """All settings between command and current loop."""

    first: GainSet
    second: GainSet
    homing: GainSet | None
    switching: Switching = Switching()
    compensation: Compensation = Compensation()
    third: ThirdGains | None = None
    swing: SwingFilter | None = None
    quadrant: QuadrantCompensation = QuadrantCompensation()
    current_loop_hz: float = 1000.0
    speed_feed_forward: float = 0.0
    speed_feed_forward_s: float = 0.0
    torque_feed_forward: float = 0.0
    torque_feed_forward_s: float = 0.0
    position_filter_hz: float = 1000.0
    speed_filter_hz: float = 1000.0
    observer_hz: float = 1000.0
    use_observer: bool = False
    inertia_kgm2: float = 1e-4
    viscous_nms: float = 0.0
    coulomb_nm: float = 0.0
    torque_filter_s: float = 0.0
    torque_filter_2_s: float | None = None
    notches: tuple[Biquad, ...] = ()
    speed_output_nm: float = math.inf
    position_output_rad_s: float = math.inf
    torque_mode_speed_rad_s: float = math.inf
    brake_speed_rad_s: float = 1.0
    brake_torque_nm: float = 0.0


@dataclass(frozen=True, slots=True)
class ProtectionSettings:
    """Thresholds; infinite (or zero for under-voltage) if a protection is off."""

    over_current_a: float = math.inf
    under_voltage_v: float = 0.0
    over_voltage_v: float = math.inf
    brake_on_v: float = math.inf
    brake_off_v: float = math.inf
    brake_enabled: bool = False
    locked_angle_rad: float = 0.0
    locked_s: float = math.inf
    overload_nm: float = math.inf
    overload_s: float = math.inf
    over_temperature_c: float = math.inf
    over_speed_rad_s: float = math.inf
    speed_error_rad_s: float = math.inf
    speed_error_s: float = math.inf
    following_error_s: float = math.inf
    holding_brake: bool = False
    braking_ohm: float = 25.0
    i2t_s: float = math.inf
    i2t_rated_nm: float = math.inf
    locked_nm: float | None = None


@dataclass(frozen=True, slots=True)
class ImpedanceSettings:
    """Gains of the impedance controller.

    Their units are not printed (004:4570-4577): Nm/rad, Nm/(rad·s) and Nm/(rad/s) are assumed.
    """

    kp: float
    ki: float
    kd: float
    filter_hz: float
    limit_nm: float


@dataclass(frozen=True, slots=True)
class MotorData:
    """Electrical data of the motor for these mechanics.

    The torque constant is the largest whose back EMF at 1.2 times rated speed uses 80 % of the
    phase voltage that space-vector modulation generates from the bus; copper losses at rated
    current are 8 % of rated power. Currents are RMS phase currents.
    """

    torque_constant: float
    rated_current_a: float
    resistance_ohm: float
    inductance_h: float
    rated_speed_rad_s: float
    rated_torque_nm: float
    pole_pairs: int
    rotor_inertia_kgm2: float
    supply_v: float

    @staticmethod
    def of(spec: MechanicsSpec) -> MotorData:
        """Derive the electrical data from rating and supply."""
        speed = spec.motor.rated_speed_rpm * math.pi / 30
        phase_rms = spec.supply.voltage_v / math.sqrt(6)
        constant = 3 * 0.8 * phase_rms / (1.2 * speed)
        current = spec.motor.rated_torque_nm / constant
        resistance = 0.08 * spec.motor.rated_torque_nm * speed / (3 * current**2)
        return MotorData(
            torque_constant=constant,
            rated_current_a=current,
            resistance_ohm=resistance,
            inductance_h=resistance / (2 * math.pi * 200),
            rated_speed_rad_s=speed,
            rated_torque_nm=spec.motor.rated_torque_nm,
            pole_pairs=spec.phases.pole_pairs,
            rotor_inertia_kgm2=spec.motor.inertia_kgm2,
            supply_v=spec.supply.voltage_v,
        )
