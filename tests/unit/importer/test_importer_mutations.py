"""Makers' files that were damaged on their way: no crash, no hang, no half result, a clear refusal.

The seeds are fixed, so that a failure comes again. `test_importer_fuzz` looks for new ones.
"""

from __future__ import annotations

import random
import re
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import datetime
from typing import TypeVar

import pytest
from importer_samples import GOOD_EDS, GOOD_ESI, ODD_EDS

from backend.axes.parameters.dcf import read_dcf
from backend.axes.parameters.set_file import BadSet
from drivers.errors import DriveError, OutOfRange
from drivers.ethercat.eeprom.image import Image, differences
from drivers.ethercat.eeprom.plan import plan_restore
from drivers.texts.imports import failure_text, finding_line
from drivers.virtual.wires.ethercat.controller.sii import SiiContent, SmLayout, build
from profiles import load_profile
from profiles.importer import ImportFailed, export_dcf, import_file
from profiles.schema import INTEGER_RANGE, Raw

T = TypeVar("T")
#: Processor time [s] of one file of a few kilobytes; a hang takes more on any computer.
LIMIT_S = 5.0
GENERIC = load_profile("generic402")
VALUES: dict[str, Raw] = {
    p.key: p.max_raw if isinstance(p.max_raw, int) else 1234567
    for p in GENERIC.parameters
    if p.index is not None and p.index >= 0x6000 and p.access == "rw" and p.type == "INT32"
}
DCF = export_dcf(GENERIC, VALUES, datetime(2026, 1, 2), file_name="x.dcf").encode()
EDS = (GOOD_EDS + "\n".join(ODD_EDS.values())).encode()
ESI = GOOD_ESI.encode()


def flip(chance: random.Random, data: bytes) -> bytes:
    made = bytearray(data)
    for _ in range(chance.randint(1, 8)):
        made[chance.randrange(len(made))] ^= 1 << chance.randrange(8)
    return bytes(made)


def cut(chance: random.Random, data: bytes) -> bytes:
    return data[: chance.randrange(len(data))]


def duplicate(chance: random.Random, data: bytes) -> bytes:
    start = chance.randrange(len(data))
    part = data[start : start + chance.randint(1, 600)]
    at = chance.randrange(len(data))
    return data[:at] + part * chance.randint(1, 5) + data[at:]


def huge(chance: random.Random, data: bytes) -> bytes:
    """Numbers that would make a careless reader count, multiply or reserve for ever."""
    number = chance.choice(
        [b"4294967295", b"0xFFFFFFFF", b"9" * 40, b"1e308", b"2147483648", b"-1"]
    )
    found = list(re.finditer(rb"(?<=[=>])(#?x?[0-9]+)(?=[\r\n<])", data))
    for match in reversed(chance.sample(found, min(len(found), 4))):
        data = data[: match.start()] + number + data[match.end() :]
    return data


def encode(chance: random.Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace")
    wrong = chance.choice(["utf-16", "utf-16-le", "utf-32", "cp037", "utf-7", "gb18030"])
    return text.encode(wrong, "replace") if chance.random() < 0.8 else data + b"\xff\xfe\x80\0"


MUTATIONS: tuple[Callable[[random.Random, bytes], bytes], ...] = (
    flip,
    cut,
    duplicate,
    huge,
    encode,
)
CASES = [(mutate, seed) for mutate in MUTATIONS for seed in range(12)]
by_case = pytest.mark.parametrize(
    ("mutate", "seed"), CASES, ids=lambda one: one if isinstance(one, int) else one.__name__
)
Mutate = Callable[[random.Random, bytes], bytes]


def taken(read: Callable[[], T]) -> T | Exception:
    """What was read, or why it was refused, within the time that a sound file may take."""
    begun = time.process_time()
    try:
        return read()
    except (ImportFailed, BadSet) as error:
        return error
    finally:
        assert time.process_time() - begun < LIMIT_S


@pytest.mark.long(keep=118)
@by_case
@pytest.mark.parametrize("whole", [EDS, ESI], ids=["eds", "esi"])
def test_a_damaged_description_makes_a_sound_profile_or_is_refused(
    mutate: Mutate, seed: int, whole: bytes
) -> None:
    data = mutate(random.Random(seed), whole)
    imported = taken(lambda: import_file(data, "damaged.file"))
    if isinstance(imported, Exception):
        assert isinstance(imported, ImportFailed)
        said = failure_text(imported).words()
        assert "damaged.file" in said
        assert failure_text(imported).words("zh") != said
        return
    # What could not be read has its place in the file.
    for finding in imported.report.findings:
        assert "damaged.file" in finding_line(finding).words()
    for parameter in imported.profile.parameters:
        low, high = INTEGER_RANGE.get(parameter.type, (None, None))
        for value in (parameter.min_raw, parameter.max_raw, parameter.default_raw):
            if low is not None and high is not None and value is not None:
                assert isinstance(value, int)
                assert low <= value <= high


@pytest.mark.parametrize("seed", range(40))
def test_of_an_esi_that_was_cut_off_no_part_is_taken(seed: int) -> None:
    end = ESI.rstrip()[:-1]
    with pytest.raises(ImportFailed):
        import_file(cut(random.Random(seed), end), "cut.xml")


@by_case
def test_a_damaged_dcf_sets_values_of_its_objects_or_is_refused(mutate: Mutate, seed: int) -> None:
    data = mutate(random.Random(seed), DCF)
    found = taken(lambda: read_dcf(data, GENERIC, "damaged.dcf"))
    if isinstance(found, Exception):
        assert isinstance(found, BadSet)
        assert "damaged.dcf" in found.message
        assert found.remedy
        return
    for reading in found.readings:
        kind = GENERIC.by_key[reading.key].type
        if kind in INTEGER_RANGE:
            low, high = INTEGER_RANGE[kind]
            assert isinstance(reading.raw, int)
            assert low <= reading.raw <= high


def test_a_dcf_that_was_cut_off_sets_no_value_that_was_not_in_it() -> None:
    """ "1234567" became 123, without a word."""
    whole = {r.key: r.raw for r in read_dcf(DCF, GENERIC, "x.dcf").readings}
    assert whole == VALUES
    last = DCF.rindex(b"ParameterValue=")
    ends = {last + len(b"ParameterValue=") + n for n in range(1, 6)}
    ends |= {random.Random(seed).randrange(len(DCF)) for seed in range(40)}
    for end in sorted(ends):
        with suppress(BadSet):
            found = read_dcf(DCF[:end], GENERIC, "x.dcf")
            got = {r.key: r.raw for r in found.readings}
            assert got.items() <= whole.items()
            # What is missing is said: by the lists of objects, or by the line that ends early.
            assert got == whole or found.problems


def _image() -> bytes:
    mailbox = (SmLayout(0x1000, 256, 0x26, 1, 1), SmLayout(0x1100, 256, 0x22, 1, 2))
    return build(
        SiiContent(
            vendor_id=0xA2B,
            product_code=0x190,
            revision=2,
            serial=77,
            alias=0,
            name="ES4",
            group="Drives",
            coe_details=0x0D,
            foe=False,
            sync_managers=mailbox,
        )
    )


@by_case
def test_a_damaged_eeprom_image_is_never_written(mutate: Mutate, seed: int) -> None:
    whole = Image(_image())
    assert whole.problem() is None
    data = mutate(random.Random(seed), whole.data)
    if data == whole.data:
        return
    damaged = Image(data)
    begun = time.process_time()
    if damaged.problem() is None:
        # Not seen by its own checks: then every difference is listed for a person.
        assert differences(whole, damaged)
        return
    with pytest.raises(OutOfRange) as error:
        plan_restore(whole, damaged, drive=whole.identity, unknown_accepted=True)
    assert isinstance(error.value, DriveError)
    assert error.value.advice
    assert time.process_time() - begun < LIMIT_S
