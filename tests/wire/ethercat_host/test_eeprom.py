"""The EEPROM behind its registers (ETG.1000.4 clause 6.4), and every frame lost once."""

from __future__ import annotations

import struct

import pytest

from drivers.errors import LinkLost, LinkTimeout
from drivers.ethercat.wire import sii
from drivers.ethercat.wire.steps import Read, Write
from tests.wire.ethercat_host.by_hand import ByHand

OWNER, CONTROL, ADDRESS, DATA = 0x500, 0x502, 0x504, 0x508
BUSY, REFUSED = 0x8000, 0x2000


class Eeprom(ByHand):
    """A controller with 64 words. A command takes 1 ms; during it another one is refused."""

    def __init__(self) -> None:
        self.words = [0x1000 + n for n in range(64)]
        self.now = 0.0
        self.frames = 0
        self.lost_out: set[int] = set()
        """Numbers of frames, from 0, that do not reach it."""
        self.lost_back: set[int] = set()
        """Those that reach it and do not come back."""
        self.there = True
        self.stands_still_s = 0.0
        """How long the next answer takes."""
        self.owner = 1
        self._memory = bytearray(0x1000)
        self._busy_until = 0.0
        self._refused = False

    def busy(self, for_s: float) -> None:
        self._busy_until = self.now + for_s

    def frame(self, step: Read | Write) -> bytes | None:
        number, self.frames = self.frames, self.frames + 1
        self.now += 50e-6
        if number in self.lost_out:
            return None
        answer = self._access(step)
        self.now, self.stands_still_s = self.now + self.stands_still_s, 0.0
        return None if number in self.lost_back else answer

    def _access(self, step: Read | Write) -> bytes | None:
        if not self.there:
            return b"" if isinstance(step, Read) and step.may_be_empty else None
        if isinstance(step, Read):
            if step.register == CONTROL:
                state = BUSY * (self.now < self._busy_until) | REFUSED * self._refused
                return struct.pack("<H", state)
            assert step.register == DATA
            return bytes(self._memory[DATA : DATA + step.size])
        if step.register == OWNER:
            self.owner = step.data[0]
            return b""
        assert self.owner == 0, "the master has it"
        self._memory[step.register : step.register + len(step.data)] = step.data
        if step.register == CONTROL:
            self._carry_out(*struct.unpack("<HI", step.data))
        return b""

    def _carry_out(self, command: int, word: int) -> None:
        self._refused = self.now < self._busy_until
        if self._refused:
            return
        self._busy_until = self.now + 0.001
        if command & 0x0100:
            struct.pack_into("<HH", self._memory, DATA, *self.words[word : word + 2])
        elif command & 0x0200:
            assert command & 1, "writing is enabled by the same frame"
            (self.words[word],) = struct.unpack_from("<H", self._memory, DATA)


def frames_of_a_read() -> int:
    eeprom = Eeprom()
    eeprom.run(sii.read(8, 4, lambda: eeprom.now))
    return eeprom.frames


@pytest.mark.parametrize("way", ["lost_out", "lost_back"])
def test_no_word_is_taken_for_another_whatever_frame_is_lost(way: str) -> None:
    for number in range(frames_of_a_read()):
        eeprom = Eeprom()
        getattr(eeprom, way).update({number, number + 1})
        words = struct.unpack("<4H", eeprom.run(sii.read(8, 4, lambda: eeprom.now)))  # noqa: B023
        assert words == (0x1008, 0x1009, 0x100A, 0x100B), f"frame {number}"
        assert eeprom.owner == 1, "it is given back"


@pytest.mark.parametrize("way", ["lost_out", "lost_back"])
def test_an_alias_is_written_with_its_checksum_whatever_frame_is_lost(way: str) -> None:
    whole = Eeprom()
    whole.run(sii.write_alias(7, lambda: whole.now))
    for number in range(whole.frames):
        eeprom = Eeprom()
        getattr(eeprom, way).add(number)
        assert eeprom.run(sii.write_alias(7, lambda: eeprom.now)) == 7  # noqa: B023
        area = struct.pack("<7H", *eeprom.words[:7])
        assert eeprom.words[:8] == [*whole.words[:7], sii.checksum(area)], f"frame {number}"
        assert eeprom.owner == 1


def test_a_busy_eeprom_ends_in_words_and_is_given_back() -> None:
    eeprom = Eeprom()
    eeprom.busy(10.0)
    with pytest.raises(LinkTimeout, match=r"EEPROM stays busy for 0\.5 s"):
        eeprom.run(sii.write_alias(7, lambda: eeprom.now))
    assert eeprom.now < 1.0
    assert eeprom.owner == 1


def test_a_computer_that_stands_still_takes_no_eeprom_for_busy() -> None:
    """The status was asked for at once, and came late: it says nothing about the time since."""
    eeprom = Eeprom()
    eeprom.busy(0.01)
    steps = sii.read(8, 4, lambda: eeprom.now)
    eeprom.stands_still_s = 0.0
    original = eeprom._access

    def first_status_is_late(step: Read | Write) -> bytes | None:
        if isinstance(step, Read) and step.register == CONTROL:
            eeprom._access = original  # type: ignore[method-assign]
            eeprom.stands_still_s = 0.8
        return original(step)

    eeprom._access = first_status_is_late  # type: ignore[method-assign]
    assert eeprom.run(steps) == struct.pack("<4H", 0x1008, 0x1009, 0x100A, 0x100B)


def test_a_station_that_is_not_there_is_reported_soon() -> None:
    eeprom = Eeprom()
    eeprom.there = False
    with pytest.raises(LinkLost, match="does not answer"):
        eeprom.run(sii.read(8, 4, lambda: eeprom.now))
    assert eeprom.now < 1.1


def test_frames_that_stay_away_for_long_end_in_words() -> None:
    eeprom = Eeprom()
    eeprom.lost_back.update(range(100_000))
    with pytest.raises(LinkLost, match="does not answer"):
        eeprom.run(sii.read(8, 4, lambda: eeprom.now))
    assert eeprom.now < 1.1
