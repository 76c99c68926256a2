"""Which writable objects can cause motion, by the manuals' own words; none is forgotten."""

from __future__ import annotations

import pytest

from profiles import drive_names, load_profile
from profiles.check import check, motion_counts, unclassified
from profiles.importer import import_file
from profiles.loader import ProfileError, is_own, parse_profile
from profiles.motion.classify import standard_rule, standard_rules
from profiles.motion.rule import MotionRule, span_of
from profiles.schema import Profile

FAMILIES = [name for name in drive_names() if not is_own(name)]

#: Objects that enable, move or release the brake, with the line of the manual that says so.
DOORS = [
    ("m6l", "2002:01"),  # 000:3219 local speed, torque and position modes
    ("m6l", "2002:02"),  # 000:3223 internal servo enable
    ("m6l", "2003:02"),  # 000:3257 functions 17, 18: jog
    ("m6l", "2003:0E"),  # 000:3275 polarity of the inputs
    ("m6l", "2003:0F"),  # 000:3276 virtual inputs
    ("m6l", "2006:02"),  # 000:3340 main reference speed
    ("m6l", "2007:04"),  # 000:3374 torque digital reference
    ("m6l", "2009:01"),  # 000:3417 offline inertia identification
    ("m6l", "200C:01"),  # 000:3618 homing
    ("m6l", "2001:15"),  # 000:3199 pole identification
    ("m6l", "2012:02"),  # 000:3678 open-loop modes
    ("m6l", "2018:02"),  # 000:3721 identification by itself
    ("m6l", "2003:13"),  # 000:3285 function of an output, brake among them
    ("r6l", "2001:01"),  # 002:8032 local modes
    ("r6l", "2002:01"),  # 002:8989 functions 39, 40: jog
    ("r6l", "2002:02"),  # 002:9042 logic of an input
    ("r6l", "2004:1F"),  # 002:9943 communication given speed
    ("r6l", "2005:15"),  # 002:10350 communication given torque
    ("r6l", "2008:12"),  # 002:11499 virtual inputs
    ("r6l", "200C:0B"),  # 002:11909 jog
    ("r6l", "200C:0C"),  # 002:11919 inertia identification
    ("r6l", "200C:10"),  # 002:11950 forced inputs and outputs
    ("r6l", "200C:15"),  # 002:11987 tuning of the current loop
    ("r6l", "2002:21"),  # 002:9222 function of an output, brake among them
    ("ep3e", "60FE:01"),  # 001: brake by bit 0
    ("ep3e", "60FE:02"),  # 001:990 its mask lets the bus rule the brake
    ("m6l", "60FE:01"),  # 000:3110 forced outputs, brake among them
    ("m6l", "60FE:02"),
    ("mms7", "2031:02"),  # 004:6547 simulated inputs
    ("mms7", "2108:01"),  # 004:2604 brake
    ("r6l", "2008:14"),  # 002:11519 virtual outputs, brake among them
    ("mms7", "200B:07"),  # 004:6221 returns to Operation enabled by itself
    ("mms7", "2031:03"),  # 004:6564 forced outputs
    ("ds_c", "2400:02"),  # 003:513 signal release
    ("ds_c", "2400:01"),  # 003:500 polarity of the inputs
    ("ds_c", "2400:0D"),  # 003:530 brake output
]

#: Setpoints of CiA 402-2: control word, mode, targets, offsets.
SETPOINTS = ("6040:00", "6060:00", "607A:00", "60FF:00", "6071:00", "60B0:00", "60B1:00", "60B2:00")

#: What decides how an axis moves or stops (CiA 402-2); named one by one in issue 17.
AT_ENABLE = (
    "605A:00", "605B:00", "605C:00", "605D:00", "605E:00", "607D:01", "607D:02", "6065:00",
    "6072:00", "60E0:00", "60E1:00", "607F:00", "607E:00", "6081:00", "6085:00", "6091:01",
    "608F:01", "6090:01", "6090:02", "6091:02", "6092:01", "6096:01", "6097:01", "60A8:00",
    "60A9:00", "60AA:00", "606A:00", "607C:00", "6065:00", "6098:00",
)  # fmt: skip


@pytest.mark.parametrize(("drive", "key"), DOORS)
def test_doors_of_the_manuals(drive: str, key: str) -> None:
    assert load_profile(drive).by_key[key].motion == "energises"


@pytest.mark.parametrize("drive", FAMILIES)
def test_every_writable_object_has_a_class(drive: str) -> None:
    profile = load_profile(drive)
    for parameter in profile.parameters:
        assert (parameter.motion is None) == (parameter.access == "ro"), parameter.key
        assert bool(parameter.motion_reason) == (parameter.motion is not None), parameter.key
    assert unclassified(profile) == []
    writable = sum(p.access != "ro" for p in profile.parameters)
    assert sum(motion_counts(profile).values()) == writable


@pytest.mark.parametrize("drive", FAMILIES)
def test_standard_objects(drive: str) -> None:
    by_key = load_profile(drive).by_key
    for key in SETPOINTS:
        if key in by_key:
            assert by_key[key].motion == "energises", key
    for key in AT_ENABLE:
        if key in by_key and by_key[key].access != "ro":
            assert (by_key[key].motion, by_key[key].safe_in_motion) == ("at_enable", False), key


@pytest.mark.parametrize("drive", FAMILIES)
def test_only_what_may_be_set_at_any_time_is_safe_in_motion(drive: str) -> None:
    for parameter in load_profile(drive).parameters:
        if parameter.safe_in_motion:
            assert parameter.motion == "at_enable", parameter.key
            assert parameter.settable == "any", parameter.key
            assert parameter.effective in ("now", "write_settings"), parameter.key


@pytest.mark.parametrize("drive", FAMILIES)
def test_no_unit_limit_or_command_is_safe_in_motion(drive: str) -> None:
    profile = load_profile(drive)
    roles = {role: p for role, p in profile.by_role.items() if p.safe_in_motion}
    assert set(roles) <= {"load_ratio", "load_inertia"}
    assert not any(profile.by_key[key].safe_in_motion for key in profile.unit_keys)


@pytest.mark.parametrize(
    ("key", "motion"),
    [
        ("6840:00", "energises"),  # control word of the second axis (CiA 402: 800h behind)
        ("70FF:00", "energises"),  # target velocity of the third axis
        ("6865:00", "at_enable"),
        ("1600:01", "energises"),  # a mapped byte becomes a target without another write
        ("1400:01", "energises"),
        ("1800:01", "energises"),
        ("1800:02", "at_enable"),
        ("1A00:01", "at_enable"),
        ("1011:01", "at_enable"),
        ("1201:02", "energises"),  # its answers could be another drive's commands
        ("1F51:01", "energises"),  # starts a program (CiA 302-3)
        ("1F80:00", "energises"),  # the device starts itself or others (CiA 302-2)
        ("1F82:02", "energises"),
        ("1F89:00", "at_enable"),
        ("60B8:00", "none"),
        # Scales of speed and acceleration, also those that CiA 402 has given up since version 2
        ("6089:00", "at_enable"),
        ("608B:00", "at_enable"),
        ("608E:00", "at_enable"),
        ("6090:02", "at_enable"),
        ("6094:01", "at_enable"),
        ("6097:01", "at_enable"),
        ("60AB:00", "at_enable"),
        ("60E8:01", "at_enable"),  # gear of a further encoder (CiA 402-2)
        ("60FE:01", "energises"),  # the brake is bit 0
        ("60FE:02", "energises"),  # its mask
        ("68FE:01", "energises"),
        ("6510:01", None),  # drive data: the contents are the maker's own
        ("2000:00", None),
        ("A000:00", None),
        ("PA_38", None),
    ],
)
def test_table_of_the_standard(key: str, motion: str | None) -> None:
    rule = standard_rule(key)
    assert (rule.motion if rule else None) == motion


def test_no_object_is_in_the_table_of_the_standard_twice_with_two_classes() -> None:
    """Ranges may nest (1800:01 in 1800), and then the first, the stricter one, counts."""
    order = {"none": 0, "at_enable": 1, "energises": 2}
    rules = standard_rules()
    for number, first in enumerate(rules):
        for second in rules[number + 1 :]:
            if any(a <= d and c <= b for a, b in first.spans for c, d in second.spans):
                assert order[first.motion] > order[second.motion], (first.keys, second.keys)


SAMPLE = """
drive: sample
title: Sample
manual: "000"
identity: {maker: A, model: B}
links: []
units: {}
supported_modes: [1]
manual_chapters:
  - {title: all, first_line: 1, last_line: 9, taken: it}
parameters:
  - {key: "6040:00", name: Control word, group: x, type: UINT16, source: "000:1"}
  - {key: "2000:01", name: Gain, group: x, type: UINT16, source: "000:2"}
  - {key: "2000:02", name: State, group: x, type: UINT16, access: ro, source: "000:3"}
"""
RULE = "motion_rules: [{keys: ['2000:01'], motion: at_enable, reason: gain}]\n"


def test_object_without_a_class_is_a_finding_and_counts_as_energises() -> None:
    profile = parse_profile({"p.yaml": SAMPLE})
    assert [f.key for f in check(profile)] == ["2000:01"]
    assert profile.by_key["2000:01"].motion == "energises"
    assert profile.by_key["2000:01"].motion_origin == "unclassified"
    assert profile.by_key["2000:02"].motion is None
    with_rule = parse_profile({"p.yaml": SAMPLE + RULE})
    assert check(with_rule) == []
    assert with_rule.by_key["2000:01"].motion == "at_enable"


def test_left_over_and_doubled_rules_are_findings() -> None:
    doubled = parse_profile({"p.yaml": SAMPLE + RULE.replace("}]", "}, {keys: ['2000'], "
                             "motion: none, reason: x}, {keys: ['3000'], motion: none, "
                             "reason: x}]")})  # fmt: skip
    assert {(f.key, f.code) for f in check(doubled)} == {
        ("2000:01", "profile-check.two-motion-rules"),
        ("3000", "profile-check.motion-rule-left-over"),
    }


def test_the_first_rule_counts_and_files_come_in_name_order() -> None:
    person = RULE.replace("at_enable", "none").replace("reason: gain", "reason: x, origin: person")
    profile = parse_profile({"motion.yaml": person, "profile.yaml": SAMPLE + RULE})
    assert profile.by_key["2000:01"].motion == "none"
    assert profile.by_key["2000:01"].motion_origin == "person"


def test_a_class_in_a_row_is_refused() -> None:
    with pytest.raises(ProfileError, match=r"profile\.class-in-row"):
        parse_profile({"p.yaml": SAMPLE.replace("access: ro", "access: ro, motion: none")})


@pytest.mark.parametrize("text", ["20", "2000:1", "2003:02-2003", "2000-1FFF", "x", "PA_5-PA_2"])
def test_wrong_ranges(text: str) -> None:
    if text == "2003:02-2003":
        assert span_of(text) == (0x200302, 0x2003FF)
        return
    with pytest.raises(ValueError, match=r"range|no key"):
        span_of(text)


def test_safe_in_motion_needs_at_enable() -> None:
    with pytest.raises(ValueError, match="at_enable"):
        MotionRule(keys=("2000",), motion="energises", safe_in_motion=True, reason="x")


EDS = b"""[DeviceInfo]
VendorName=Maker
ProductName=Drive
[6040]
ParameterName=Controlword
DataType=0x0006
AccessType=rww
PDOMapping=1
[6041]
ParameterName=Statusword
DataType=0x0006
AccessType=ro
[2005]
ParameterName=Start of everything
DataType=0x0006
AccessType=rw
"""


def test_unknown_objects_of_a_makers_file_energise() -> None:
    profile: Profile = import_file(EDS, "drive.eds").profile
    unknown = profile.by_key["2005:00"]
    assert (unknown.motion, unknown.motion_origin) == ("energises", "unclassified")
    assert profile.by_key["6040:00"].motion_origin == "standard"
    assert profile.by_key["6041:00"].motion is None
    assert [p.key for p in unclassified(profile)] == ["2005:00"]
