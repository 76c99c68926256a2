"""Functions of a family: which parameters belong together, and how they are used.

A page shows a function by this description and never by the name of a drive. Keys refer to
parameters of the same profile. Information missing in a manual is left out, not guessed.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from profiles.record import BadRecord, Frozen


class ParameterGroup(Frozen):
    """Parameters that a person sets together, on one page."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    page: Literal["motion", "gains", "io", "setup"]
    title: str
    help: str = ""
    keys: tuple[str, ...]
    source: str = ""


class GainBlock(Frozen):
    """Parameters that belong to one block of the control loops.

    ``set_number`` distinguishes the gain sets between which a drive switches.
    """

    block: Literal[
        "level", "inertia", "command_filter", "position", "speed_ff", "speed", "torque_ff",
        "torque_filter", "notch", "adaptive", "current", "feedback_filter", "switching",
        "compensation", "limits",
    ]  # fmt: skip
    set_number: int | None = None
    help: str = ""
    keys: tuple[str, ...]
    source: str = ""


class HistorySlot(Frozen):
    """One stored fault with parameters of its own; ``name`` empty: named by its number."""

    name: str = ""
    code_key: str
    fields: tuple[str, ...] = ()


class FaultHistory(Frozen):
    """Where a drive stores its past faults.

    *slots*: each record has parameters of its own, newest first. *selected*: writing a number to
    ``select_key`` selects the record that the same parameters show. *unreadable*: the drive stores
    records for which the manual prints no object.
    """

    kind: Literal["slots", "selected", "unreadable"]
    size: int
    slots: tuple[HistorySlot, ...] = ()
    select_key: str | None = None
    code_key: str | None = None
    fields: tuple[str, ...] = ()
    newest_first: bool = Field(default=True, description="False where the order is not printed")
    empty_codes: tuple[int, ...] = (0,)
    code_base: int = Field(default=0, description="added to a code before the fault table is asked")
    code_format: str = Field(default="", description="code as the fault table writes it: AL.{:03d}")
    source: str
    notes: str = ""


class TerminalBits(Frozen):
    """A parameter with one bit per terminal."""

    key: str
    bits: dict[str, int] = Field(description="terminal to bit")


class Forcing(Frozen):
    """A way to override terminals: outputs that are forced, or inputs that are simulated.

    A terminal is overridden while its bit in ``enable`` is set, and then follows its bit in
    ``value``. Without ``enable``, a set bit in ``value`` overrides by itself and only to "on".
    """

    name: Literal["outputs", "simulation"]
    title: str
    help: str
    warning: str
    enable: TerminalBits | None = None
    value: TerminalBits
    needs_function: int | None = Field(
        default=None, description="function code that a terminal must have to be overruled"
    )
    needs_cyclic: bool = Field(default=False, description="acts only while process data run")
    source: str
    notes: str = ""


class TerminalFacts(Frozen):
    """States, polarities and overriding of the terminals."""

    states: tuple[TerminalBits, ...] = ()
    polarities: tuple[TerminalBits, ...] = ()
    unused_inputs: tuple[int, ...] = Field(default=(0,), description="codes that mean no function")
    unused_outputs: tuple[int, ...] = ()
    brake_functions: tuple[int, ...] = Field(
        default=(), description="output functions that hold a load: such an output is never forced"
    )
    forcing: tuple[Forcing, ...] = ()
    notes: str = ""


class Probe(Frozen):
    """One touch probe. ``sources``: value of the source bits of 60B8h to its meaning."""

    sources: dict[int, str]
    rising_key: str | None = None
    falling_key: str | None = None


class TouchProbe(Frozen):
    """Touch probes with the bits of CiA 402 (60B8h, 60B9h)."""

    function_key: str
    status_key: str
    probes: tuple[Probe, ...]
    source: str
    notes: str = ""


class BrakeTiming(Frozen):
    """Holding brake: the parameters with the times of its sequence.

    ``open_fixed_ms`` is a printed time that cannot be set.
    """

    present_key: str | None = None
    open_delay_key: str | None = Field(default=None, description="servo on to brake output on")
    open_fixed_ms: float | None = None
    command_delay_key: str | None = Field(default=None, description="brake output on to commands")
    close_delay_key: str | None = Field(
        default=None, description="servo off while turning to brake output off, at the latest"
    )
    close_speed_key: str | None = Field(default=None, description="below this speed it closes")
    hold_key: str | None = Field(default=None, description="brake output off to power off")
    keys: tuple[str, ...] = ()
    output_functions: tuple[int, ...] = ()
    fault: str = ""
    source: str
    notes: str = ""


class BrakeTest(Frozen):
    """How the holding brake can be kept closed while the axis is enabled, to test it.

    Either ``output_function`` (a function that never switches the brake output on by itself,
    assigned to it for the test) or ``obstacle``: why the drive has no such way.
    """

    output_function: int | None = None
    obstacle: Literal["built_in", "fixed_output", "bus_bit"] | None = Field(
        default=None,
        description="built_in: the brake inside follows the power stage; fixed_output: the output "
        "that drives it cannot be given another function; bus_bit: process data rule it",
    )
    source: str

    @model_validator(mode="after")
    def _one_of_both(self) -> BrakeTest:
        if (self.output_function is None) == (self.obstacle is None):
            raise BadRecord("profile.brake-test-one-of")
        return self


class ResistorModel(Frozen):
    """Braking data of one model in the manual's table; None where it prints nothing."""

    model: str
    resistance_ohm: float | None = None
    power_w: float | None = Field(default=None, description="power that it may dissipate for long")
    min_external_ohm: float | None = None
    max_external_w: float | None = None
    capacitor_j: float | None = Field(default=None, description="energy that the DC bus takes up")


class Regeneration(Frozen):
    """Braking resistor: table of the models and the parameters that describe one."""

    models: tuple[ResistorModel, ...] = ()
    min_key: str | None = None
    type_key: str | None = None
    external_raw: int | None = Field(default=None, description="type that means: external")
    power_key: str | None = None
    resistance_key: str | None = None
    load_key: str | None = None
    on_voltage_key: str | None = None
    keys: tuple[str, ...] = ()
    source: str
    notes: str = ""


IdentificationState = Literal[
    "idle", "preparation", "resistance", "ready_for_inductance", "inductance_d", "inductance_q",
    "sensor_bias", "torque_constant", "torque_constant_limited", "inertia", "inertia_again",
    "inertia_limited", "complete", "homing", "acceleration_design", "error_handling", "error",
    "waiting", "jog_homing",
]  # fmt: skip
"""State of a drive's own identification; ``limited``: within a range of travel."""


class DriveIdentification(Frozen):
    """Identification started by a bit of the control word; an object reports its state."""

    control_bit: int = Field(ge=0, le=15)
    status_key: str
    states: dict[int, IdentificationState] = Field(
        default_factory=dict, description="what each value of the status means"
    )
    done: tuple[int, ...]
    failed: tuple[int, ...] = ()
    keys: tuple[str, ...] = Field(description="results, and parameters that the drive changes")
    warning: str
    source: str
    notes: str = ""


class GuideStep(Frozen):
    """One step of a guide: text, parameters to check, and a procedure to run."""

    title: str
    text: str
    keys: tuple[str, ...] = ()
    procedure: str | None = None
    identifies: bool = Field(
        default=False, description="the drive's own identification starts here"
    )


class Guide(Frozen):
    """A sequence that a person follows step by step."""

    name: Literal["pole_identification", "identification"]
    title: str
    warning: str = ""
    steps: tuple[GuideStep, ...]
    failures: tuple[str, ...] = Field(default=(), description="fault codes that report failure")
    source: str
    notes: str = ""


class GearLimits(Frozen):
    """Limits of the electronic gear: encoder increments per user increment."""

    min_ratio: float | None = None
    max_ratio: float | None = None
    strict: bool = Field(default=True, description="False where the manual breaks its own bounds")
    fault: str = ""
    acts: str = Field(default="", description="when a change acts, in words")
    encoder_bits_key: str | None = Field(
        default=None, description="parameter with the bits of the encoder at hand"
    )
    encoder_counts_key: str | None = Field(
        default=None, description="parameter with the increments per revolution of the encoder"
    )
    also_one: tuple[str, ...] = Field(
        default=(), description="gear parameters that are set to 1 because another holds the ratio"
    )
    source: str = ""
    notes: str = ""


class Functions(Frozen):
    """Everything that a family's pages need beyond its parameters, faults and procedures."""

    groups: tuple[ParameterGroup, ...] = ()
    gain_blocks: tuple[GainBlock, ...] = ()
    history: FaultHistory | None = None
    terminals: TerminalFacts = TerminalFacts()
    probe: TouchProbe | None = None
    brake: BrakeTiming | None = None
    brake_test: BrakeTest | None = None
    regeneration: Regeneration | None = None
    guides: tuple[Guide, ...] = ()
    identification: DriveIdentification | None = None
    gear: GearLimits = GearLimits()


def referenced_keys(functions: Functions) -> list[str]:
    """Return every parameter key that the functions refer to."""
    found: list[str] = []
    for group in functions.groups:
        found += group.keys
    for block in functions.gain_blocks:
        found += block.keys
    found += _history_keys(functions.history)
    facts = functions.terminals
    found += [bits.key for bits in (*facts.states, *facts.polarities)]
    for forcing in facts.forcing:
        found.append(forcing.value.key)
        if forcing.enable is not None:
            found.append(forcing.enable.key)
    if functions.probe is not None:
        found += [functions.probe.function_key, functions.probe.status_key]
        for probe in functions.probe.probes:
            found += [key for key in (probe.rising_key, probe.falling_key) if key is not None]
    for record in (
        functions.brake,
        functions.regeneration,
        functions.gear,
        functions.identification,
    ):
        found += _named_keys(record)
    for guide in functions.guides:
        for step in guide.steps:
            found += step.keys
    return found


def _history_keys(history: FaultHistory | None) -> list[str]:
    if history is None:
        return []
    found = [key for key in (history.select_key, history.code_key) if key is not None]
    found += history.fields
    for slot in history.slots:
        found += [slot.code_key, *slot.fields]
    return found


def _named_keys(record: Frozen | None) -> list[str]:
    """Return the values of fields named ``…_key``, ``keys`` or ``also_one``."""
    found: list[str] = []
    for name in type(record).model_fields if record is not None else ():
        value = getattr(record, name)
        if name.endswith("_key") and isinstance(value, str):
            found.append(value)
        elif name in ("keys", "also_one"):
            found += value
    return found
