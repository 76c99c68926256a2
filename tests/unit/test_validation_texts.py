"""What pydantic refuses is explained in the reader's language, with the limit."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal, get_args

import pytest
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic_core.core_schema import ErrorType

from drivers.texts.message import Text, Unsuitable, text
from drivers.texts.validation import _REASONS, reason_of, refusal_of


class _Limits(BaseModel):
    model_config = ConfigDict(extra="forbid")

    count: int = Field(default=1, ge=1, le=9)
    speed: float = Field(default=1.0, gt=0, lt=2.5, allow_inf_nan=False)
    name: str = Field(default="ab", min_length=2, max_length=3, pattern="^[a-z]+$")
    letter: str = Field(default="a", min_length=1)
    kind: Literal["a", "b", "c"] = "a"
    rows: list[int] = Field(default=[1], min_length=1, max_length=2)
    values: dict[str, int] = Field(default={})
    flag: bool = False
    day: datetime | None = None
    moment: AwareDatetime | None = None


class _Needs(BaseModel):
    size: float


class _Jog(BaseModel):
    type: Literal["jog"]


class _Stop(BaseModel):
    type: Literal["stop"]


def _first(kind: object, given: object) -> dict[str, object]:
    with pytest.raises(ValidationError) as refused:
        TypeAdapter(kind).validate_python(given)  # type: ignore[arg-type]
    return dict(refused.value.errors()[0])


@pytest.mark.parametrize(
    ("given", "english", "chinese"),
    [
        (
            {"count": 0},
            "count: Input should be greater than or equal to 1",
            "count：必须大于或等于 1",
        ),
        (
            {"count": 10},
            "count: Input should be less than or equal to 9",
            "count：必须小于或等于 9",
        ),
        ({"speed": 0}, "speed: Input should be greater than 0", "speed：必须大于 0"),
        ({"speed": 2.5}, "speed: Input should be less than 2.5", "speed：必须小于 2.5"),
        ({"speed": "x"}, "speed: Input should be a valid number", "speed：必须为数值"),
        (
            {"speed": float("nan")},
            "speed: Input should be a finite number",
            "speed：必须为有限的数值",
        ),
        ({"count": "x"}, "count: Input should be a valid integer", "count：必须为整数"),
        ({"count": None}, "count: Input should be a valid integer", "count：必须为整数"),
        (
            {"count": 1.5},
            "count: Input should be a valid integer, got a number with a fractional part",
            "count：必须为整数，不能带小数",
        ),
        ({"name": "a"}, "name: String should have at least 2 characters", "name：至少 2 个字符"),
        (
            {"letter": ""},
            "letter: String should have at least 1 character",
            "letter：至少 1 个字符",
        ),
        ({"name": "abcd"}, "name: String should have at most 3 characters", "name：最多 3 个字符"),
        (
            {"name": "A1"},
            "name: String should match pattern ^[a-z]+$",
            "name：必须符合格式 ^[a-z]+$",
        ),
        ({"name": 3}, "name: Input should be a valid string", "name：必须为文本"),
        (
            {"kind": "z"},
            "kind: Input should be one of 'a', 'b', 'c'",
            "kind：必须为以下之一：'a', 'b', 'c'",
        ),
        (
            {"rows": []},
            "rows: There should be at least 1 item, not 0",
            "rows：至少需要 1 项，实际为 0 项",
        ),
        (
            {"rows": [1, 2, 3]},
            "rows: There should be at most 2 items, not 3",
            "rows：最多允许 2 项，实际为 3 项",
        ),
        ({"rows": 3}, "rows: Input should be a valid list", "rows：必须为列表"),
        ({"rows": [1, "x"]}, "rows.1: Input should be a valid integer", "rows.1：必须为整数"),
        (
            {"values": 3},
            "values: Input should be a valid object",
            "values：必须为对象（字段名和值）",
        ),
        ({"flag": 2}, "flag: Input should be true or false", "flag：必须为 true 或 false"),
        ({"day": "x"}, "day: Input should be a valid date and time", "day：不是有效的日期和时间"),
        (
            {"moment": datetime(2026, 3, 1)},
            "moment: The time should have a time zone",
            "moment：时间必须带时区",
        ),
        ({"speeed": 1}, "speeed: Extra inputs are not permitted", "speeed：不接受此字段"),
    ],
)
def test_a_refused_field_is_named_with_its_limit(
    given: dict[str, object], english: str, chinese: str
) -> None:
    refusal = refusal_of(_first(_Limits, given))
    assert (refusal.words("en"), refusal.words("zh")) == (english, chinese)


def test_a_missing_field_and_an_unknown_kind_are_named() -> None:
    refusal = refusal_of(_first(_Needs, {}))
    assert refusal.words("en") == "size: Field required"
    assert refusal.words("zh") == "size：缺少此字段"
    either = Annotated[_Jog | _Stop, Field(discriminator="type")]
    assert "'type' 为 fly，必须为以下之一：'jog', 'stop'" in refusal_of(
        _first(either, {"type": "fly"})
    ).words("zh")
    assert "'type'" in refusal_of(_first(either, {})).words("zh")


def test_the_limit_is_a_typed_fact() -> None:
    assert reason_of(_first(_Limits, {"count": 0})) == Text(
        "input.greater-than-equal", {"bound": 1}
    )
    assert reason_of(_first(_Limits, {"speed": 0})) == Text("input.greater-than", {"bound": 0})


def test_the_reason_of_an_own_validator_is_its_message() -> None:
    why = text("input.scale-not-upwards", low=2, high=1)
    error = {
        "type": "value_error",
        "loc": (),
        "msg": "Value error, …",
        "ctx": {"error": Unsuitable(why)},
    }
    assert refusal_of(error) == why


def test_another_type_keeps_the_words_of_the_library() -> None:
    error = {"type": "url_parsing", "loc": ("url",), "msg": "Input should be a valid URL"}
    assert refusal_of(error).words("zh") == "url：Input should be a valid URL"
    renamed = {"type": "less_than", "loc": (), "msg": "Input should be less than 3", "ctx": {}}
    assert refusal_of(renamed).words("en") == "Input should be less than 3"


def test_every_listed_type_is_one_of_the_library() -> None:
    assert set(_REASONS) <= set(get_args(ErrorType))
