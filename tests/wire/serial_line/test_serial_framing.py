"""Frames, byte for byte. Vectors: manual 003:1040-1170; V1.1b3 for what the manual leaves out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import NotAllowed, OutOfRange, ProtocolError
from drivers.modbus.framing import (
    Request,
    RequestParser,
    crc16,
    exception_response,
    find_answer,
    is_sealed,
    read_query,
    read_response,
    seal,
    write_many_query,
    write_one_query,
    write_response,
)
from drivers.modbus.registers import Place, plan_blocks, to_bytes, to_words, words_of

READ_REQUEST = bytes.fromhex("01 03 00 0A 00 01 A4 08")  # 003:1044-1052
READ_ANSWER = bytes.fromhex("01 03 02 00 00 B8 44")  # 003:1058-1066
ONE_REQUEST = bytes.fromhex("01 06 00 70 00 14 88 1E")  # 003:1073-1082 and its echo 1090-1098
MANY_REQUEST = bytes.fromhex("01 10 00 B0 00 02 04 03 E8 00 64 79 40")  # 003:1103-1118
MANY_ANSWER = bytes.fromhex("01 10 00 B0 00 02 40 2F")  # 003:1124-1134


def test_golden_requests() -> None:
    assert read_query(1, 0x000A, 1).frame == READ_REQUEST
    assert write_one_query(1, 0x0070, 20).frame == ONE_REQUEST
    assert write_many_query(1, 0x00B0, (1000, 100)).frame == MANY_REQUEST


def test_golden_answers_are_built() -> None:
    assert read_response(1, (0,)) == READ_ANSWER
    assert write_response(Request(1, 6, 0x70, 1, (20,))) == ONE_REQUEST
    assert write_response(Request(1, 16, 0xB0, 2, (1000, 100))) == MANY_ANSWER


def test_golden_answers_are_understood() -> None:
    assert find_answer(READ_ANSWER, read_query(1, 10, 1)).frame == READ_ANSWER
    assert find_answer(ONE_REQUEST, write_one_query(1, 0x70, 20)).frame == ONE_REQUEST
    assert find_answer(MANY_ANSWER, write_many_query(1, 0xB0, (1000, 100))).frame == MANY_ANSWER


def test_golden_requests_are_understood_by_a_slave() -> None:
    parser = RequestParser()
    assert parser.feed(READ_REQUEST + ONE_REQUEST + MANY_REQUEST) == [
        Request(1, 3, 10, 1),
        Request(1, 6, 0x70, 1, (20,)),
        Request(1, 16, 0xB0, 2, (1000, 100)),
    ]
    assert parser.skipped_bytes == 0


def test_the_one_wrong_crc_of_the_manual() -> None:
    """003:1155-1168 prints 10 00 behind 01 86 04, where the CRC of every other frame is right.

    The CRC of 01 86 04 is 43 A3. No refusal of 03, 06 or 16 by station 1, with any exception
    code and either byte order, has the CRC 10 00: it is a slip of the manual and no variant of
    the algorithm, which the other six printed frames confirm.
    """
    assert exception_response(1, 6, 4) == bytes.fromhex("01 86 04 43 A3")
    assert not is_sealed(bytes.fromhex("01 86 04 10 00"))
    refusals = [bytes((1, fc, code)) for fc in (0x83, 0x86, 0x90) for code in range(256)]
    assert not {crc16(r) for r in refusals} & {0x1000, 0x0010}
    answer = find_answer(bytes.fromhex("01 86 04 10 00"), write_one_query(1, 0x70, 20))
    assert answer.frame is None
    assert answer.crc_errors == 1


def test_crc_check_value() -> None:
    # Catalogue of parametrised CRC algorithms, CRC-16/MODBUS: check of "123456789" is 4B37h.
    assert crc16(b"123456789") == 0x4B37


def test_exception_is_an_answer() -> None:
    answer = find_answer(bytes.fromhex("01 83 02") + b"\xc0\xf1", read_query(1, 10, 1))
    assert answer.exception == 2


@pytest.mark.parametrize("noise", [b"\x00", b"\x01\x03\x02", READ_ANSWER[:-1], READ_REQUEST])
def test_answer_is_found_behind_noise(noise: bytes) -> None:
    true = read_response(1, (0xBEEF,))
    answer = find_answer(noise + true, read_query(1, 10, 1))
    assert answer.frame == true
    assert (answer.start, answer.end) == (len(noise), len(noise) + len(true))


def test_another_stations_answer_is_not_ours() -> None:
    assert find_answer(read_response(2, (7,)), read_query(1, 10, 1)).frame is None
    assert find_answer(read_response(1, (7, 8)), read_query(1, 10, 1)).frame is None
    other_value = write_one_query(1, 0x70, 21).frame
    assert find_answer(other_value, write_one_query(1, 0x70, 20)).frame is None


@given(st.binary(max_size=400))
def test_answer_parser_survives_any_bytes(data: bytes) -> None:
    for query in (read_query(1, 0, 1), read_query(3, 9, 125), write_one_query(1, 2, 3)):
        answer = find_answer(data, query)
        if answer.frame is not None:
            assert is_sealed(answer.frame)
            assert answer.frame == data[answer.start : answer.end]


@given(st.binary(max_size=60), st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=125))
def test_answer_is_found_in_any_surroundings(noise: bytes, words: list[int]) -> None:
    true = read_response(9, words)
    assert find_answer(noise + true, read_query(9, 0, len(words))).frame is not None


@given(st.binary(max_size=300), st.lists(st.integers(1, 64), max_size=8))
def test_request_parser_survives_any_bytes_in_any_portions(data: bytes, cuts: list[int]) -> None:
    parser = RequestParser()
    rest = data
    for cut in cuts:
        parser.feed(rest[:cut])
        rest = rest[cut:]
    parser.feed(rest)
    parser.end_of_frame()
    assert parser.feed(ONE_REQUEST) == [Request(1, 6, 0x70, 1, (20,))]


@given(st.integers(1, 12))
def test_request_arrives_in_any_two_portions(cut: int) -> None:
    parser = RequestParser()
    first = parser.feed(MANY_REQUEST[:cut])
    assert first + parser.feed(MANY_REQUEST[cut:]) == [Request(1, 16, 0xB0, 2, (1000, 100))]


def test_request_behind_the_start_of_a_longer_one_is_found_at_silence() -> None:
    # 01 10 … 7B F6 announces 123 registers that never come.
    parser = RequestParser()
    assert parser.feed(bytes.fromhex("01 10 00 00 00 7B F6") + READ_REQUEST) == []
    assert parser.end_of_frame() == [Request(1, 3, 10, 1)]


def test_unknown_function_is_seen_at_silence() -> None:
    parser = RequestParser()
    assert parser.feed(seal(b"\x01\x2b\x0e\x01\x00")) == []
    assert parser.end_of_frame() == [Request(1, 0x2B, 0, 0)]


@pytest.mark.parametrize(("station", "start", "count"), [
    (0, 0, 1), (248, 0, 1), (1, 0, 0), (1, 0, 126), (1, 0xFFFF, 2), (1, -1, 1),
])  # fmt: skip
def test_impossible_reads_are_refused(station: int, start: int, count: int) -> None:
    with pytest.raises(OutOfRange):
        read_query(station, start, count)


def test_impossible_writes_are_refused() -> None:
    with pytest.raises(OutOfRange):
        write_one_query(1, 0, 0x10000)
    with pytest.raises(OutOfRange):
        write_many_query(1, 0, [0] * 124)


# --- values and registers ---

LOW_FIRST = Place(0, 2, "UINT32", "low_first")
HIGH_FIRST = Place(0, 2, "UINT32", "high_first")


def test_word_orders() -> None:
    # 12345678h: MLink sends the low word first (drives.md), DS_C the high word (manual 003).
    value = bytes.fromhex("78563412")
    assert to_words(LOW_FIRST, value) == (0x5678, 0x1234)
    assert to_words(HIGH_FIRST, value) == (0x1234, 0x5678)
    assert to_bytes(LOW_FIRST, bytes.fromhex("56781234")) == value
    assert to_bytes(HIGH_FIRST, bytes.fromhex("12345678")) == value


def test_small_values_fill_a_register() -> None:
    signed = Place(0, 1, "INT8", "low_first")
    assert to_words(signed, b"\xfd") == (0xFFFD,)
    assert to_bytes(signed, b"\xff\xfd") == b"\xfd"
    assert to_bytes(signed, b"\x00\xfd") == b"\xfd"
    assert to_words(Place(0, 1, "UINT8", "low_first"), b"\xfd") == (0x00FD,)
    with pytest.raises(ProtocolError, match="not a valid UINT8"):
        to_bytes(Place(0, 1, "UINT8", "low_first"), b"\xff\xfd")


@given(st.sampled_from(["low_first", "high_first"]), st.binary(min_size=8, max_size=8))
def test_values_survive_the_way_there_and_back(order: str, data: bytes) -> None:
    for kind, size in (("INT8", 1), ("UINT16", 2), ("REAL32", 4), ("INT64", 8)):
        place = Place(0, max(1, size // 2), kind, order)  # type: ignore[arg-type]
        words = to_words(place, data[:size])
        assert to_bytes(place, b"".join(w.to_bytes(2, "big") for w in words)) == data[:size]


def test_text_has_no_registers() -> None:
    with pytest.raises(NotAllowed, match="STRING"):
        words_of("STRING")


def _place(start: int, count: int = 1, group: int | None = 0) -> Place:
    return Place(start, count, "UINT16" if count == 1 else "UINT32", "high_first", group)


def test_neighbours_share_a_block() -> None:
    places = [_place(12), _place(10, 2), _place(13)]
    (block,) = plan_blocks(places, 125, 0)
    assert (block.start, block.count, block.items) == (10, 4, (1, 0, 2))


def test_gaps_and_length_split_blocks() -> None:
    places = [_place(0), _place(3), _place(10), _place(11, 2)]
    assert [(b.start, b.count) for b in plan_blocks(places, 125, 2)] == [(0, 4), (10, 3)]
    assert [(b.start, b.count) for b in plan_blocks(places, 125, 1)] == [(0, 1), (3, 1), (10, 3)]
    assert [(b.start, b.count) for b in plan_blocks(places, 2, 9)] == [
        (0, 1),
        (3, 1),
        (10, 1),
        (11, 2),
    ]


def test_overlapping_and_lonely_values_are_not_joined() -> None:
    # 6099h:01 and :02 at 6990h and 6991h: two 32-bit values whose numbers overlap.
    assert len(plan_blocks([_place(0x6990, 2, None), _place(0x6991, 2, None)], 125, 9)) == 2
    assert len(plan_blocks([_place(5, 2), _place(6, 2)], 125, 9)) == 2
    assert len(plan_blocks([_place(5, 2), _place(5, 2)], 125, 0)) == 1


@given(
    st.lists(st.tuples(st.integers(0, 300), st.integers(1, 2)), max_size=60),
    st.integers(2, 20),
    st.integers(0, 5),
)
def test_every_value_is_in_one_block(raw: list[tuple[int, int]], longest: int, gap: int) -> None:
    places = [_place(start, count) for start, count in raw]
    blocks = plan_blocks(places, longest, gap)
    assert sorted(i for b in blocks for i in b.items) == list(range(len(places)))
    for block in blocks:
        assert block.count <= longest
        for item in block.items:
            assert block.start <= places[item].start
            assert places[item].end <= block.start + block.count
