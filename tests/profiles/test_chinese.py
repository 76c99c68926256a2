"""Chinese texts of the profiles: complete, and saying the same as the English ones."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from profiles import load_profile
from profiles.language.overlay import load_overlay, load_shared, parse_overlay
from profiles.language.texts import check_overlay, texts_of, translations, untranslated
from profiles.loader import ProfileError

FAMILIES = ("mms7", "ds_c", "ep3e", "m6l", "r6l", "el7", "generic402")
#: Wrong terms of the term base, with the right one.
FORBIDDEN = {
    "模数": "取模", "制动器": "抱闸", "去使能": "断使能", "断开使能": "断使能", "共振": "谐振",
    "幅值裕度": "增益裕度", "调整时间": "调节时间", "准备接通": "准备就绪", "总线关闭": "总线离线",
    "零点": "原点", "空轴": "裸轴", "设定点": "设定值", "刚度过高": "增益过高",
    "帧错误": "帧格式错误",
}  # fmt: skip


@pytest.mark.parametrize("family", FAMILIES)
def test_every_text_of_every_kind_is_translated(family: str) -> None:
    missing = untranslated(load_profile(family), load_overlay(family, "zh"))
    assert [(text.place, text.english) for text in missing] == []


@pytest.mark.parametrize("family", FAMILIES)
def test_overlay_is_about_texts_that_exist(family: str) -> None:
    assert check_overlay(load_profile(family), load_overlay(family, "zh")) == []


@pytest.mark.parametrize("family", FAMILIES)
def test_every_number_of_the_english_text_stands_in_the_chinese_one(family: str) -> None:
    number = re.compile(r"\d+(?:\.\d+)?")
    texts = translations(load_profile(family), load_overlay(family, "zh"))
    wrong = [
        (english, chinese)
        for english, chinese in texts.items()
        if set(number.findall(english)) != set(number.findall(chinese))
    ]
    assert wrong == []


@pytest.mark.parametrize("family", FAMILIES)
def test_no_wrong_term_is_used(family: str) -> None:
    texts = translations(load_profile(family), load_overlay(family, "zh")).values()
    assert [(wrong, text) for text in texts for wrong in FORBIDDEN if wrong in text] == []


def test_a_new_fault_without_chinese_is_found() -> None:
    profile = load_profile("mms7")
    added = profile.faults[0].model_copy(update={"code": "0xFFFF", "name": "A fault of next year"})
    grown = profile.model_copy(update={"faults": (*profile.faults, added)})
    missing = untranslated(grown, load_overlay("mms7", "zh"), "faults")
    assert ("faults", "0xFFFF", "name") in {text.place for text in missing}


def test_translation_of_a_text_that_was_corrected_is_not_shown() -> None:
    profile = load_profile("mms7")
    overlay = load_overlay("mms7", "zh")
    assert translations(profile, overlay)["Over-current"] == "过流"
    assert "Overcurrent" not in translations(profile, overlay)


def test_text_about_nothing_is_reported() -> None:
    overlay = parse_overlay("mms7/zh", {"a.yaml": 'faults: {"0x0001": {name: 无此故障}}'})
    assert [f.key for f in check_overlay(load_profile("mms7"), overlay)] == ["faults.0x0001.name"]


def test_unknown_field_is_refused() -> None:
    with pytest.raises(ProfileError, match="remedy"):
        parse_overlay("mms7/zh", {"a.yaml": 'faults: {"0x2300": {remedy: 复位}}'})


def test_text_given_in_two_files_is_refused() -> None:
    one = 'faults: {"0x2300": {name: 过流}}'
    with pytest.raises(ProfileError, match="0x2300"):
        parse_overlay("mms7/zh", {"a.yaml": one, "b.yaml": one})


def test_texts_of_the_standard_hold_for_a_profile_that_somebody_imported() -> None:
    texts = translations(load_profile("generic402"), load_overlay("imported_drive", "zh"))
    assert texts["Target position"] == "目标位置"


def test_each_shared_text_is_of_the_standard_or_of_two_families() -> None:
    used = Counter(
        english
        for family in FAMILIES
        for english in {text.english for text in texts_of(load_profile(family))}
    )
    standard = {text.english for text in texts_of(load_profile("generic402"))}
    lone = [text for text in load_shared("zh") if text not in standard and used[text] < 2]
    assert lone == []


def test_own_translation_of_a_family_goes_before_the_shared_one() -> None:
    own = parse_overlay("mms7/zh", {"a.yaml": 'common: {"Target position": 目标位置值}'})
    overlay = own.model_copy(update={"shared": load_shared("zh")})
    texts = translations(load_profile("mms7"), overlay)
    assert (texts["Target position"], texts["Target velocity"]) == ("目标位置值", "目标速度")


def test_file_of_a_family_cannot_give_texts_of_all_families() -> None:
    with pytest.raises(ProfileError, match=r"profile\.shared-field"):
        parse_overlay("mms7/zh", {"a.yaml": 'shared: {"Target position": 目标位置}'})


#: Texts of a profile that no page shows: sources, remarks to whoever maintains the profile, and
#: the inventory of the manual, which `profile check` reads.
NOT_SHOWN = (
    "source", "manual", "drive", "title", "manual_chapters", "chapters", "conflicts",
    "motion_rules", "identity", "units", "pdo", "gains", "notch", "stiffness", "signals",
    "slow_vibration", "faults.notes", "faults.also_printed", "faults.led", "faults.severity",
    "links.notes", "functions.regeneration.models.model", "homing_methods.also_printed",
)  # fmt: skip


def _written(value: object, path: str = "") -> Iterator[tuple[str, str]]:
    """Every text of two words or more in a record, with the path of its field."""
    if isinstance(value, str):
        if " " in value.strip():
            yield path, value
    elif isinstance(value, BaseModel):
        for name in type(value).model_fields:
            yield from _written(getattr(value, name), f"{path}.{name}".strip("."))
    elif isinstance(value, dict):
        for each in value.values():
            yield from _written(each, path)
    elif isinstance(value, tuple | list):
        for each in value:
            yield from _written(each, path)


def _shown(path: str) -> bool:
    last = path.rpartition(".")[2]
    return last not in ("source", "unit") and not any(
        path == out or path.startswith(f"{out}.") for out in NOT_SHOWN
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_every_text_that_a_page_shows_counts_as_one_to_translate(family: str) -> None:
    profile = load_profile(family)
    counted = {text.english for text in texts_of(profile)}
    forgotten = {path for path, text in _written(profile) if _shown(path) and text not in counted}
    assert forgotten == set()
