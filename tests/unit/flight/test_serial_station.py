"""The file of one station of a serial line has its whole answers."""

from __future__ import annotations

from drivers.flight.kinds import serial_ring

NOW = 1_800_000_000_123_456_789


def test_an_answer_in_portions_is_whole_and_those_of_others_are_left_out() -> None:
    """USB adapters hand an answer on in portions, and only the first begins with the address."""
    ring = serial_ring("/dev/ttyUSB0")
    for at, (sent, data) in enumerate(
        (
            (True, b"\x01\x03first-question"),
            (False, b"\x01\x03first"),
            (False, b"-answer"),
            (True, b"\x02\x03second-question"),
            (False, b"\x02\x03second"),
            (False, b"\x01-tail-that-begins-like-another-address"),
        )
    ):
        ring.put(NOW + at, sent, data)
    of_first, of_second = ring.file(1), ring.file(2)
    for part in (b"first-question", b"\x01\x03first", b"-answer"):
        assert part in of_first
        assert part not in of_second
    for part in (b"second-question", b"\x02\x03second", b"-tail-that-begins-like"):
        assert part in of_second
        assert part not in of_first
