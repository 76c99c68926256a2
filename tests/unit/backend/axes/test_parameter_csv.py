"""CSV lists: what is understood, what is refused, and that nothing makes the reader crash."""

from __future__ import annotations

import csv
import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backend.axes.parameters.csv_list import read_csv, write_csv
from backend.axes.parameters.set_file import BadSet, Row
from profiles import load_profile
from profiles.schema import Profile

MMS7 = load_profile("mms7")


def values(profile: Profile, text: str) -> dict[str, object]:
    return {r.key: r.raw for r in read_csv(text.encode(), profile).readings}


def test_what_is_written_is_read(profile: Profile) -> None:
    text = write_csv(profile, [Row("2005:03", 350), Row("2100:00", -7)])
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0] == ["key", "name", "group", "unit", "value", "raw"]
    assert rows[1] == ["2005:03", "Speed bandwidth", "Gains", "Hz", "35.0", "350"]
    assert values(profile, text) == {"2005:03": 350, "2100:00": -7}


@pytest.mark.parametrize(
    "text",
    [
        "key,raw\n2005:03,350\n",
        "key;value;unit\n2005:03;35,0;Hz\n",
        "Index,Subindex,Name,Value\n0x2005,3,Speed bandwidth,35.0\n",
        "Index\tSub Index\tData\n2005h\t0x03\t0x15E\n",
        "# made by a tool\n0x2005, 3, 350\n",
        "2005:03, 350\n",
        "2005h:03h;350\n",
        "0x2005:3,350",
        "\ufeffkey,raw\r\n2005:03,350\r\n",
        "sep=;\r\nkey;value\r\n2005:03;35,0\r\n",
        '"sep=,"\nkey,value\n2005:03,35.0\n',
        'key,name,value\n2005:03,"Speed\nbandwidth",35.0\n',
        "key;value;unit\n2005:03;35;[hz]\n",
        "key;value;unit\n2005:03;35;\n",
    ],
)
def test_lists_of_other_tools(profile: Profile, text: str) -> None:
    assert values(profile, text) == {"2005:03": 350}


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("9999:00,1", "no parameter"),
        ("2005:03,many", "not a number"),
        ("2005:10,1.5", "not a whole number"),
        ("2005:10,", "no value"),
        ("2100:00,1", "comes twice"),
        ("2005:03,nan", "not a number"),
        ("2005:03,1e999", "not a number"),
    ],
)
def test_a_bad_line_spoils_only_itself(profile: Profile, line: str, complaint: str) -> None:
    found = read_csv(f"key,raw\n2100:00,5\n{line}\n".encode(), profile)
    assert [(r.key, r.raw) for r in found.readings] == [("2100:00", 5)]
    assert len(found.problems) == 1
    assert complaint in found.problems[0].words()


@pytest.mark.parametrize("number", ["1,000", "1.000", "-12.500", "1.000.000", "1,000,000"])
def test_a_thousand_or_one_is_not_guessed(profile: Profile, number: str) -> None:
    found = read_csv(f"key;raw\n2100:00;5\n2005:03;{number}\n".encode(), profile)
    assert "two ways" in found.problems[0].words()


def test_another_unit_is_not_taken_for_the_parameters(profile: Profile) -> None:
    found = read_csv(b"key,value,unit\n2100:00,5,\n2005:03,0.35,kHz\n", profile)
    assert [r.key for r in found.readings] == ["2100:00"]
    assert [str(each) for each in found.problems] == [
        "line 3: 2005:03: 0.35 is in kHz, and this parameter is in Hz"
    ]


def test_problems_name_the_line_of_the_file(profile: Profile) -> None:
    text = "# made by a tool\n\nkey,raw\n2100:00,5\n\n2005:03,many\n"
    assert read_csv(text.encode(), profile).problems[0].words().startswith("line 6: ")


@pytest.mark.parametrize("encoding", ["utf-16", "gb18030", "cp1252", "utf-8-sig"])
def test_encodings_of_spreadsheets(profile: Profile, encoding: str) -> None:
    name = "速度环带宽，优先" if encoding != "cp1252" else "Geschwindigkeit für Größe"
    data = f"key;name;raw\n2005:03;{name};350\n".encode(encoding)
    assert {r.key: r.raw for r in read_csv(data, profile).readings} == {"2005:03": 350}


def test_text_of_several_lines_stays_whole() -> None:
    generic = load_profile("generic402")
    text = 'it\'s, "x"\n;\r\n速度'
    written = write_csv(generic, [Row("6404:00", text)])
    assert values(generic, written) == {"6404:00": text}


def test_no_formulas_for_spreadsheets(profile: Profile) -> None:
    evil = profile.parameters[0].model_copy(update={"name": "=1+1"})
    changed = Profile.model_validate(
        profile.model_dump() | {"parameters": (evil, *profile.parameters[1:])}
    )
    assert ",'=1+1," in write_csv(changed, [Row(evil.key, 1)])
    assert "\n'=2+2," in write_csv(changed, [Row("=2+2", 1)])


@pytest.mark.parametrize("data", [b"", b"\0\0\0", b"hello", b"\xff\xfe\0", b"x" * 5_000_000])
def test_what_is_no_list_is_refused_in_words(profile: Profile, data: bytes) -> None:
    with pytest.raises(BadSet):
        read_csv(data, profile)


@settings(deadline=None)
@given(st.binary(max_size=400) | st.text(max_size=400).map(lambda t: t.encode("utf-8", "replace")))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for head in (b"", b"key,raw\n", b"Index;Subindex;Value\n"):
        try:
            found = read_csv(head + data, MMS7)
        except BadSet:
            continue
        for reading in found.readings:
            assert reading.key in MMS7.by_key
            assert MMS7.by_key[reading.key].type in ("STRING", "OCTETS") or isinstance(
                reading.raw, (int, float)
            )


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["6083:00", "0x6083", "6083h", "2005:01", "PA_38", "9999:00", '"']),
            st.sampled_from(["0", "", "0x1", "-1", "1e5", "9" * 30, "1.5", "1,5", '"', "nan"]),
            st.sampled_from([",", ";", "\t", ", ", '",']),
        ),
        max_size=8,
    )
)
def test_odd_lines_are_read_or_refused(lines: list[tuple[str, str, str]]) -> None:
    text = "\n".join(f"{key}{mark}{value}" for key, value, mark in lines)
    try:
        read_csv(text.encode(), MMS7)
    except BadSet:
        return


@pytest.mark.parametrize(
    ("line", "plain"),
    [
        ("0x2005, 3, 350, 360, 370", "0x2100, 0, 5, 5, 5"),
        ("0x2005, 3, 350, 350, 360 # of three axes", "0x2100, 0, 5, 5, 5 # each"),
        ("2005:03;350;0;1000", "2100:00;5"),
        ("0x2005,3,16,350", "0x2100,0,5"),
    ],
)
def test_several_numbers_without_a_heading_are_not_guessed(
    profile: Profile, line: str, plain: str
) -> None:
    """A list of six axes gave the commutation offset of its first motor to any drive."""
    found = read_csv(f"{line}\n{plain}\n".encode(), profile)
    assert [(r.key, r.raw) for r in found.readings] == [("2100:00", 5)]
    assert "2005:03: several numbers (" in found.problems[0].words()
    assert "350" in found.problems[0].words()


@pytest.mark.parametrize(
    "line",
    ["0x2005, 3, 350, 350, 350 # the same for all", "2005:03,350,Speed bandwidth,Hz,a 3rd name"],
)
def test_one_number_and_words_behind_it_are_plain(profile: Profile, line: str) -> None:
    assert values(profile, f"{line}\n") == {"2005:03": 350}


@pytest.mark.parametrize(
    "heading", ["key;Set value;Actual value", "key;Actual value;Set value", "key;raw;data"]
)
def test_of_several_columns_of_values_none_is_chosen(profile: Profile, heading: str) -> None:
    """The first one was taken: the actual values of a machine, for those that it should have."""
    with pytest.raises(BadSet, match="several columns of values") as error:
        read_csv(f"{heading}\n2005:03;35;36\n".encode(), profile, "list.csv")
    assert all(title in str(error.value) for title in heading.split(";")[1:])
    assert "delete all of these columns but the one" in str(error.value.remedy)


@pytest.mark.parametrize("value", ["36.0", "34.9", "0x24"])
def test_a_value_that_was_changed_without_its_raw_value_is_refused(
    profile: Profile, value: str
) -> None:
    """The export has both; a change of the value alone in a spreadsheet was without effect."""
    found = read_csv(f"key,value,raw\n2100:00,5,5\n2005:03,{value},350\n".encode(), profile)
    assert [r.key for r in found.readings] == ["2100:00"]
    assert "2005:03: raw 350 is 35.0 in the unit" in found.problems[0].words()


@pytest.mark.parametrize("value", ["35.0", "35", "3.5e1", "many", "", "34.7,350,kHz"])
def test_a_value_beside_its_raw_value_may_have_fewer_digits(profile: Profile, value: str) -> None:
    row = value if "," in value else f"{value},350,Hz"
    assert values(profile, f"key,value,raw,unit\n2005:03,{row}\n") == {"2005:03": 350}
