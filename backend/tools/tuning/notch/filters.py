"""Notches of a drive: read, preview how the drive would realise a wanted notch, write.

Encodings come from the profile (`NotchSpec`); the effect of levels without a documented formula is
not guessed here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from backend.analysis.loop.notch import (
    IntegerRange,
    Notch,
    NotchCoefficients,
    RealisedNotch,
    coefficients_response,
    decode_coefficients,
    decode_hz_width_db,
    encode_coefficients,
    encode_hz_width_db,
    highest_hz,
    realised,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.tools.measuring.temporary import write_settings
from backend.tools.thresholds import notch_filters as threshold
from backend.tools.tuning.notch.meaning import NotchMeaning
from backend.tools.tuning.notch.steps import attenuation_steps, hz_steps, level_steps
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.message import Text, Unsuitable, reason_of, text
from profiles.schema import NotchSlot, NotchSpec, Parameter, Profile

UNKNOWN_DEPTH_DB = threshold.UNKNOWN_DEPTH_DB


@dataclass(frozen=True)
class SlotState:
    """One notch of the drive. ``notch`` is None where its values define none (or only levels)."""

    slot: int
    enabled: bool
    notch: Notch | None
    realised: RealisedNotch | None
    raw: Mapping[str, int]
    note: Text | None = None


@dataclass(frozen=True)
class Preview:
    """How a wanted notch would be realised; ``realised`` is None where no formula is known."""

    slot: int
    asked: Notch | None
    raw: Mapping[str, int]
    realised: RealisedNotch | None
    note: Text | None = None


def spec_of(profile: Profile, drive: str) -> NotchSpec:
    """Notch encoding of the profile.

    Raises:
        NotAllowed: the family documents no notch.
    """
    if profile.notch is None:
        raise NotAllowed(
            "notch.documents-no-notch-filters", drive=drive, profile_title=profile.title
        )
    return profile.notch


def _slot(spec: NotchSpec, number: int, drive: str) -> NotchSlot:
    if not 0 <= number < len(spec.slots):
        raise OutOfRange(
            "notch.no-notch", drive=drive, value=number + 1, limit=f"1…{len(spec.slots)}"
        )
    return spec.slots[number]


def _value_keys(slot: NotchSlot) -> tuple[str, ...]:
    keys = (
        slot.a1_key,
        slot.a2_key,
        slot.b1_key,
        slot.b2_key,
        slot.frequency_key,
        slot.width_key,
        slot.depth_key,
    )
    return tuple(key for key in keys if key is not None)


def _hz_width_db(
    profile: Profile, slot: NotchSlot
) -> tuple[IntegerRange, IntegerRange, IntegerRange]:
    """Steps of frequency, width and attenuation.

    Raises:
        Unsuitable: the unit of a step is not known.
    """
    keys = profile.by_key
    frequency, width = keys[slot.frequency_key or ""], keys[slot.width_key or ""]
    return hz_steps(frequency), hz_steps(width), attenuation_steps(keys[slot.depth_key or ""])


def _width_steps(slot: NotchSlot, width: Parameter) -> IntegerRange:
    """Steps of a width whose effect is measured: Hz, or levels where the depth has levels too."""
    return hz_steps(width) if slot.depth_key is None else level_steps(width)


def _coefficients(slot: NotchSlot, raw: Mapping[str, int]) -> NotchCoefficients:
    keys = (slot.a1_key, slot.a2_key, slot.b1_key, slot.b2_key)
    values = [raw[key] for key in keys if key is not None]
    return NotchCoefficients(*values)


def encode(
    profile: Profile,
    drive: str,
    number: int,
    notch: Notch | None,
    enable_now: int | None,
    meaning: NotchMeaning | None = None,
) -> Preview:
    """Raw values for one slot; None switches it off. ``enable_now`` is its present enable word.

    ``meaning`` is the measured effect of values that no manual documents.

    Raises:
        NotAllowed: no notches, or an encoding without a documented formula.
        OutOfRange: the drive cannot realise this notch.
    """
    spec = spec_of(profile, drive)
    slot = _slot(spec, number, drive)
    raw: dict[str, int] = {}
    made: RealisedNotch | None = None
    note: Text | None = None
    if notch is not None:
        _require_below_highest(spec, drive, number, notch)
        try:
            raw, made, note = _encoded(profile, spec, slot, notch, meaning)
        except ValueError as error:
            raise OutOfRange(
                "notch.notch",
                drive=drive,
                value=f"{notch.center_hz:g} Hz",
                number=number + 1,
                cause=reason_of(error),
            ) from error
    raw |= _enable(profile, slot, notch is not None, enable_now)
    _require_meant(profile, drive, number, notch, raw, meaning)
    return Preview(number, notch, raw, made, note)


def _require_below_highest(spec: NotchSpec, drive: str, number: int, notch: Notch) -> None:
    """Check that coefficients can be computed at all.

    Raises:
        OutOfRange: centre or width is above half the rate of the loop.
    """
    if spec.encoding != "coefficients" or spec.sample_time_s is None:
        return
    highest = highest_hz(spec.sample_time_s)
    value = max(notch.center_hz, notch.width_hz)
    if not value <= highest:
        raise OutOfRange(
            "notch.above-highest",
            drive=drive,
            value=f"{value:g} Hz",
            limit=limits.between(0.0, highest, "Hz"),
            number=number + 1,
            highest_hz=highest,
        )


def _require_meant(
    profile: Profile,
    drive: str,
    number: int,
    notch: Notch | None,
    raw: Mapping[str, int],
    meaning: NotchMeaning | None,
) -> None:
    """Check that these values, read back, define a notch at the wanted frequency.

    Raises:
        OutOfRange: they define none, or one elsewhere.
    """
    spec = spec_of(profile, drive)
    if notch is None or spec.encoding == "coefficients":
        # Coefficients determine their own response, however coarse.
        return
    slot = spec.slots[number]
    on = slot.enable_key is not None or slot.frequency_key is None
    on = on or raw[slot.frequency_key or ""] != off_raw(profile, slot.frequency_key or "")
    try:
        got = _decoded(profile, spec, slot, number, raw, on, meaning).notch if on else None
    except ValueError:
        got = None
    if got is None or abs(got.center_hz / notch.center_hz - 1.0) > threshold.ELSEWHERE:
        raise OutOfRange(
            "notch.read-back-other",
            drive=drive,
            value=f"{notch.center_hz:g} Hz",
            limit=text("limit.notch-there"),
            number=number + 1,
            read_hz=0.0 if got is None else got.center_hz,
        )


def _enable(profile: Profile, slot: NotchSlot, on: bool, enable_now: int | None) -> dict[str, int]:
    if slot.enable_key is not None:
        bit = 1 << (slot.enable_bit or 0)
        word = enable_now or 0
        return {slot.enable_key: word | bit if on else word & ~bit}
    if not on and slot.frequency_key is not None:
        return {slot.frequency_key: off_raw(profile, slot.frequency_key)}
    return {}


def off_raw(profile: Profile, frequency_key: str) -> int:
    """Raw frequency of a notch that is off, in a family without an enable bit.

    All notches are off by default: in some families by a frequency of 0, in others by the highest.

    Raises:
        NotAllowed: the manual does not state it.
    """
    parameter = profile.by_key[frequency_key]
    _low, high = parameter.raw_limits
    default = parameter.default_raw
    if isinstance(default, int) and default in (0, high):
        return default
    raise NotAllowed("notch.manual-not-say-how", parameter=parameter.key, key=parameter.name)


def _encoded(
    profile: Profile, spec: NotchSpec, slot: NotchSlot, notch: Notch, meaning: NotchMeaning | None
) -> tuple[dict[str, int], RealisedNotch | None, Text | None]:
    if spec.encoding == "coefficients":
        if spec.sample_time_s is None:
            raise Unsuitable(text("notch.loop-period-unknown"))
        stored = encode_coefficients(notch, spec.sample_time_s)
        names = (slot.a1_key, slot.a2_key, slot.b1_key, slot.b2_key)
        values = (stored.a1, stored.a2, stored.b1, stored.b2)
        raw = {k: v for k, v in zip(names, values, strict=True) if k is not None}
        return raw, realised(stored, spec.sample_time_s), None
    if slot.frequency_key is None or slot.width_key is None:
        raise Unsuitable(text("notch.parameters-not-named"))
    if spec.encoding in ("hz_width", "hz_levels"):
        return _by_measure(profile, slot, notch, meaning)
    if spec.encoding == "hz_width_db" and slot.depth_key is not None:
        steps = _hz_width_db(profile, slot)
        hz, wide, db = encode_hz_width_db(notch, *steps)
        shown = decode_hz_width_db((hz, wide, db), *steps)
        made = RealisedNotch(shown.center_hz, shown.width_hz, shown.depth_db, 0.0, True)
        return {slot.frequency_key: hz, slot.width_key: wide, slot.depth_key: db}, made, None
    raise Unsuitable(text("notch.parameters-not-named"))


def _by_measure(
    profile: Profile, slot: NotchSlot, notch: Notch, meaning: NotchMeaning | None
) -> tuple[dict[str, int], RealisedNotch | None, Text | None]:
    """Raw values of an undocumented encoding, by its measured effect."""
    keys = profile.by_key
    frequency, width = keys[slot.frequency_key or ""], keys[slot.width_key or ""]
    depth = None if slot.depth_key is None else level_steps(keys[slot.depth_key])
    steps = hz_steps(frequency), _width_steps(slot, width)
    if meaning is None and depth is not None:
        raise Unsuitable(text("notch.levels-not-explained"))
    made = meaning or NotchMeaning(notch.center_hz)
    hz, wide, deep = made.encoded(notch, *steps, depth)
    raw = {frequency.key: hz, width.key: wide}
    if slot.depth_key is not None and deep is not None:
        raw[slot.depth_key] = deep
    if meaning is None:
        return raw, None, text("notch.no-depth-measure")
    got = meaning.decoded((hz, wide, deep), *steps)
    shown = RealisedNotch(got.center_hz, got.width_hz, got.depth_db, 0.0, True)
    return raw, shown, text("notch.as-measured")


def response(
    profile: Profile, notch: Notch, frequency_hz: FloatArray, meaning: NotchMeaning | None = None
) -> ComplexArray:
    """Response of a notch as the family's drive realises it [lines].

    Raises:
        ValueError: the drive cannot realise it.
    """
    spec = profile.notch
    if spec is None:
        raise Unsuitable(text("notch.family-documents-none"))
    if spec.encoding == "coefficients" and spec.sample_time_s is not None:
        stored = encode_coefficients(notch, spec.sample_time_s)
        return coefficients_response(stored, frequency_hz, spec.sample_time_s)
    if spec.encoding == "hz_width_db":
        made = _possible(profile, notch, None).realised
        if made is not None:
            notch = Notch(made.center_hz, made.width_hz, made.depth_db)
    elif meaning is not None:
        made = _possible(profile, notch, meaning).realised
        if made is not None:
            notch = Notch(made.center_hz, made.width_hz, made.depth_db)
    return notch.response(frequency_hz)


def _possible(profile: Profile, notch: Notch, meaning: NotchMeaning | None) -> Preview:
    """As `encode`; ValueError where the notch is outside the drive's ranges."""
    try:
        return encode(profile, profile.drive, 0, notch, None, meaning)
    except OutOfRange as error:
        raise Unsuitable(error.text) from error


async def read_notches(drive: Drive, meaning: NotchMeaning | None = None) -> tuple[SlotState, ...]:
    """Read all notches of a drive.

    Raises:
        NotAllowed: the family documents none.
    """
    spec = spec_of(drive.profile, drive.name)
    return tuple([await _read(drive, spec, n, meaning) for n in range(len(spec.slots))])


async def _read(
    drive: Drive, spec: NotchSpec, number: int, meaning: NotchMeaning | None
) -> SlotState:
    slot = spec.slots[number]
    raw = {key: await drive.raw(key) for key in _value_keys(slot)}
    enabled = True
    if slot.enable_key is not None:
        word = await drive.raw(slot.enable_key)
        raw[slot.enable_key] = word
        enabled = bool(word >> (slot.enable_bit or 0) & 1)
    elif slot.frequency_key is not None:
        enabled = raw[slot.frequency_key] != off_raw(drive.profile, slot.frequency_key)
    try:
        return _decoded(drive.profile, spec, slot, number, raw, enabled, meaning)
    except ValueError as error:
        return SlotState(number, enabled, None, None, raw, reason_of(error) if enabled else None)


def _decoded(
    profile: Profile, spec: NotchSpec, slot: NotchSlot, number: int, raw: Mapping[str, int],
    enabled: bool, meaning: NotchMeaning | None,
) -> SlotState:  # fmt: skip
    if spec.encoding == "coefficients" and spec.sample_time_s is not None:
        stored = _coefficients(slot, raw)
        notch = decode_coefficients(stored, spec.sample_time_s)
        return SlotState(number, enabled, notch, realised(stored, spec.sample_time_s), raw)
    hz = raw.get(slot.frequency_key or "", 0)
    wide, deep = raw.get(slot.width_key or "", 0), raw.get(slot.depth_key or "", 0)
    if spec.encoding == "hz_width_db" and slot.depth_key is not None:
        notch = decode_hz_width_db((hz, wide, deep), *_hz_width_db(profile, slot))
        made = RealisedNotch(notch.center_hz, notch.width_hz, notch.depth_db, 0.0, True)
        return SlotState(number, enabled, notch, made, raw)
    if slot.frequency_key is None or slot.width_key is None:
        return SlotState(number, enabled, None, None, raw, text("notch.parameters-not-named"))
    frequency = hz_steps(profile.by_key[slot.frequency_key])
    width = _width_steps(slot, profile.by_key[slot.width_key])
    if meaning is not None:
        given = (hz, wide, deep if slot.depth_key is not None else None)
        notch = meaning.decoded(given, frequency, width)
        made = RealisedNotch(notch.center_hz, notch.width_hz, notch.depth_db, 0.0, True)
        return SlotState(number, enabled, notch, made, raw, text("notch.as-measured"))
    if spec.encoding == "hz_width":
        notch = Notch(frequency.value(hz), width.value(max(wide, 1)), UNKNOWN_DEPTH_DB)
        return SlotState(number, enabled, notch, None, raw, text("notch.no-depth"))
    return SlotState(number, enabled, None, None, raw, text("notch.no-meaning"))


async def plan_notches(
    drive: Drive, wanted: Sequence[Notch | None], meaning: NotchMeaning | None = None
) -> dict[str, int]:
    """Raw values that set the drive's slots to these notches and switch the other slots off.

    Raises:
        OutOfRange, NotAllowed: the drive cannot realise one of them; nothing is written.
    """
    spec = spec_of(drive.profile, drive.name)
    if len(wanted) > len(spec.slots):
        raise OutOfRange(
            "notch.notches-not",
            drive=drive.name,
            value=len(wanted),
            limit=str(len(spec.slots)),
            slots=len(spec.slots),
        )
    words = {s.enable_key: await drive.raw(s.enable_key) for s in spec.slots if s.enable_key}
    raw: dict[str, int] = {}
    for number, slot in enumerate(spec.slots):
        notch = wanted[number] if number < len(wanted) else None
        word = words.get(slot.enable_key or "")
        made = encode(drive.profile, drive.name, number, notch, word, meaning)
        raw |= made.raw
        if slot.enable_key is not None:
            words[slot.enable_key] = made.raw[slot.enable_key]
    if spec.apply_key is not None and spec.apply_raw is not None:
        raw[spec.apply_key] = spec.apply_raw
    return raw


async def write_notches(
    axis: Axis, wanted: Sequence[Notch | None], meaning: NotchMeaning | None = None
) -> dict[str, int]:
    """Write all slots; returns the previous raw values, for undo.

    Raises:
        NotAllowed: the axis is enabled, or the drive cannot realise a notch. Nothing stays partly
            written.
    """
    return await write_settings(axis, await plan_notches(axis.drive, wanted, meaning))


def combined(
    profile: Profile,
    notches: Sequence[Notch],
    frequency_hz: FloatArray,
    meaning: NotchMeaning | None = None,
) -> ComplexArray:
    """Response of all notches in series as the drive realises them [lines]."""
    total: ComplexArray = np.ones(frequency_hz.shape, dtype=np.complex128)
    for notch in notches:
        total = np.asarray(total * response(profile, notch, frequency_hz, meaning))
    return total
