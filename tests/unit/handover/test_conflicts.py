"""Thirty planted conflicts are found, and none is invented; defects of a foreign list."""

from __future__ import annotations

import struct

import pytest

from backend.records.handover.conflicts import Verdict, changed_since, compare, diagnose, resolved
from backend.records.handover.listed import ControllerList
from backend.records.handover.model import hand_over
from backend.records.handover.read import read_list
from profiles import load_profile
from profiles.schema import Raw
from tests.unit.handover.test_formats import set_of

PROFILE = load_profile("mms7")
OURS: dict[str, Raw] = {row.key: row.raw for row in set_of(PROFILE).rows if row.raw is not None}


def bits(key: str) -> int:
    return {"8": 1, "16": 2, "32": 4, "64": 8}[PROFILE.by_key[key].type.lstrip("UINT")]


def init_command(key: str, data: bytes, transition: str = "PS", *, hexadecimal: bool = False,
                 complete: bool = False) -> str:  # fmt: skip
    index, subindex = (int(part, 16) for part in key.split(":"))
    number = f"#x{index:04x}" if hexadecimal else str(index)
    whole = ' CompleteAccess="1"' if complete else ""
    return (
        f"<InitCmd{whole}>"
        f"<Transition>{transition}</Transition><Comment><![CDATA[x]]></Comment>"
        f"<Timeout>0</Timeout><Ccs>1</Ccs><Index>{number}</Index>"
        f"<SubIndex>{subindex}</SubIndex><Data>{data.hex()}</Data></InitCmd>"
    )


def twincat(*commands: str) -> ControllerList:
    body = "".join(commands)
    text = f"<EtherCATMailbox><CoE><InitCmds>{body}</InitCmds></CoE></EtherCATMailbox>"
    return read_list(text.encode(), PROFILE)


def codesys(*rows: tuple[str, str, int]) -> ControllerList:
    lines = ["Line;Index:Subindex;Name;Value;Bit length;Abort on error"]
    for number, (key, value, size) in enumerate(rows, 1):
        index, _, subindex = key.partition(":")
        lines.append(f"{number};16#{index}:16#{subindex};x;{value};{8 * size};FALSE")
    return read_list("\r\n".join(lines).encode(), PROFILE)


def found(verdict: Verdict) -> dict[str, Raw]:
    return {each.key: each.controller for each in verdict.conflicts}


def little(value: int, size: int) -> bytes:
    return value.to_bytes(size, "little", signed=value < 0)


def whole_numbers() -> list[str]:
    """Settings of the set that have an object and may be another whole number."""
    axis = hand_over(set_of(PROFILE), PROFILE)
    return [w.key for w in axis.writes if isinstance(w.raw, int)]


GAINS = ("2005:01", "2005:02", "2005:03", "2005:04")
UNITS = ("6091:01", "6091:02", "6092:01", "6092:02")
LIMITS = ("6072:00", "6065:00", "607D:01", "607D:02", "60E0:00", "60E1:00")


def test_thirty_planted_conflicts_are_all_found_and_none_is_invented() -> None:
    keys = whole_numbers()
    assert {*GAINS, *UNITS, "6072:00"} <= set(keys)
    named = [k for k in (*GAINS, *UNITS, *LIMITS) if k in keys]
    planted = named + [k for k in keys if k not in named][: 30 - len(named)]
    assert len(planted) == 30
    wanted: dict[str, Raw] = {}
    commands = []
    for number, key in enumerate(keys):
        raw = OURS[key]
        assert isinstance(raw, int)
        size = bits(key)
        if key in planted:
            # The byte order alone is another value as well: 3 as 03 00 and as 00 03.
            other = (
                int.from_bytes(little(raw, size)[::-1], "little") if number % 3 == 0 else raw + 1
            )
            other = raw + 1 if other == raw else other
            data = (other % (1 << 8 * size)).to_bytes(size, "little")
            signed = not PROFILE.by_key[key].type.startswith("U")
            wanted[key] = int.from_bytes(data, "little", signed=signed)
        else:
            data = (raw % (1 << 8 * size)).to_bytes(size, "little")
        commands.append(init_command(key, data, hexadecimal=number % 2 == 0))
    verdict = compare(PROFILE, twincat(*commands), OURS, None)
    assert found(verdict) == wanted
    assert verdict.same == len(keys) - 30
    kinds = {each.key: each.consequence for each in verdict.conflicts}
    assert {kinds[key] for key in GAINS} == {"gain"}
    assert {kinds[key] for key in UNITS} == {"unit"}
    assert {kinds[key] for key in LIMITS if key in kinds} == {"limit"}
    for each in verdict.conflicts:
        if each.consequence == "gain":
            assert each.sentence.words().startswith("the controller will undo your tuning of ")


@pytest.mark.parametrize("form", ["lcec", "codesys", "csv", "igh", "ros2", "eni", "dcf"])
def test_every_format_of_the_set_itself_has_no_conflict(form: str) -> None:
    from backend.records.handover.files import files_of

    axis = hand_over(set_of(PROFILE), PROFILE)
    data = files_of(axis, form, "list", None)["list"]  # type: ignore[arg-type]
    verdict = compare(PROFILE, read_list(data, PROFILE), OURS, None)
    assert verdict.conflicts == ()
    assert verdict.same == len(axis.writes)
    assert verdict.findings == ()


@pytest.mark.parametrize(
    ("text", "raw"),
    [("-5", -5), ("16#FFFB", -5), ("65531", -5), ("0xfffb", -5), ("#xFFFB", -5), ("-6", -6),
     ("16#FBFF", -1025)],
)  # fmt: skip
def test_one_value_in_several_encodings_is_one_value(text: str, raw: int) -> None:
    # IEC 61131-3 hexadecimal of the bits: INT16 −5 is FFFBh, and FBFFh with the bytes exchanged.
    key = next(k for k in OURS if PROFILE.by_key[k].type == "INT16" and not PROFILE.by_key[k].enum)
    verdict = compare(PROFILE, codesys((key, text, 2)), {key: -5}, None)
    assert found(verdict) == ({} if raw == -5 else {key: raw})


def test_a_subindex_beside_it_is_no_conflict() -> None:
    listed = twincat(init_command("2005:02", little(99, 2)))
    assert found(compare(PROFILE, listed, {"2005:01": 40}, None)) == {}
    assert found(compare(PROFILE, listed, {"2005:02": 40}, None)) == {"2005:02": 99}


def test_of_two_entries_the_later_one_counts() -> None:
    first, last = init_command("6072:00", little(500, 2)), init_command("6072:00", little(900, 2))
    verdict = compare(PROFILE, twincat(first, last), {"6072:00": 900}, None)
    assert verdict.conflicts == ()
    assert [f.kind for f in verdict.findings] == ["twice"]
    verdict = compare(PROFILE, twincat(last, first), {"6072:00": 900}, None)
    assert found(verdict) == {"6072:00": 500}


def test_complete_access_is_taken_apart() -> None:
    # ETG.1000.6 clause 5.6.2: subindex 0 takes 16 bits, then the entries without a gap.
    data = struct.pack("<BxII", 2, 7, 3)
    listed = twincat(init_command("6091:00", data, complete=True))
    assert [(w.key, w.data) for w in listed.writes] == [
        ("6091:01", little(7, 4)),
        ("6091:02", little(3, 4)),
    ]
    assert found(compare(PROFILE, listed, {"6091:01": 3, "6091:02": 3}, None)) == {"6091:01": 7}
    from_one = twincat(init_command("6091:01", data[2:], complete=True))
    assert from_one.writes[0].data == little(7, 4)
    xml = (
        '<masters><master idx="0"><slave idx="0" type="generic">'
        f'<sdoConfig idx="6091" subIdx="complete"><sdoDataRaw data="{data.hex(" ")}"/></sdoConfig>'
        "</slave></master></masters>"
    )
    assert read_list(xml.encode(), PROFILE).writes[1].data == little(3, 4)


def test_what_the_drive_holds_counts_where_the_set_has_nothing() -> None:
    listed = twincat(init_command("6060:00", b"\x01"), init_command("6072:00", little(900, 2)))
    verdict = compare(PROFILE, listed, {"6072:00": 900}, {"6060:00": 8, "6072:00": 300})
    (conflict,) = verdict.conflicts
    assert (conflict.key, conflict.controller, conflict.ours, conflict.drive) == (
        "6060:00",
        1,
        None,
        8,
    )
    assert conflict.consequence == "motion"
    # The controller writes what our set says: that undoes nothing, and is said all the same.
    assert verdict.restored == ("6072:00",)
    alone = compare(PROFILE, listed, {"6072:00": 900}, None)
    assert alone.unknown_here == ("6060:00",)
    assert alone.conflicts == ()


def test_what_the_drive_did_not_give_is_named() -> None:
    listed = twincat(init_command("6060:00", b"\x01"), init_command("6072:00", little(900, 2)))
    # A drive that was too slow: its value may be any, also where list and set agree.
    verdict = compare(PROFILE, listed, {"6072:00": 900}, {"6060:00": None})
    assert verdict.not_read == ("6060:00", "6072:00")
    assert verdict.unknown_here == ("6060:00",)
    assert compare(PROFILE, listed, {"6072:00": 900}, None).not_read == ()


def test_defects_of_a_foreign_list() -> None:
    listed = twincat(
        init_command("6041:00", little(0, 2)),
        init_command("6072:00", little(65535, 2)),
        init_command("6072:00", little(500, 4)),
        init_command("5555:01", little(0, 2)),
        init_command("6040:00", little(15, 2)),
        init_command("2005:01", little(40, 2), "OP"),
        init_command("6091:01", little(3, 4)),
    )
    kinds = {(f.key, f.kind) for f in diagnose(PROFILE, listed)}
    assert kinds == {
        ("6041:00", "read_only"),
        ("6072:00", "range"),
        ("6072:00", "size"),
        ("6072:00", "twice"),
        ("5555:01", "unknown"),
        ("6040:00", "energises"),
        ("2005:01", "state"),
        ("6091:01", "order"),
    }
    assert resolved(PROFILE, listed)[0].key == "6041:00"


def test_a_list_that_locks_the_drive_is_named() -> None:
    # M6L manual, P02.21: 1 and 2 block the other parameters.
    profile = load_profile("m6l")
    text = init_command("2002:16", little(1, 2))
    xml = f"<EtherCATMailbox><CoE><InitCmds>{text}</InitCmds></CoE></EtherCATMailbox>"
    assert [f.kind for f in diagnose(profile, read_list(xml.encode(), profile))] == ["locks"]


def test_what_changed_since_the_hand_over() -> None:
    changes = changed_since(PROFILE, {"6072:00": 900, "2005:01": 40}, {"6072:00": 300})
    assert [(c.key, c.ours, c.drive, c.consequence) for c in changes] == [
        ("6072:00", 900, 300, "limit")
    ]


def test_a_command_that_is_disabled_or_reads_writes_nothing() -> None:
    kept = init_command("2005:01", little(40, 2))
    text = init_command("6072:00", little(500, 2))
    disabled = text.replace("<InitCmd>", '<InitCmd Disabled="1">')
    reads = text.replace("<Ccs>1", "<Ccs>2").replace("<Data>f401</Data>", "<Data></Data>")
    assert [w.key for w in twincat(kept, disabled, reads).writes] == ["2005:01"]
    # One maker's tools count 2 as a write and give data with it: it must not be missed.
    other = text.replace("<Ccs>1", "<Ccs>2")
    assert [w.key for w in twincat(other).writes] == ["6072:00"]
