"""Units of input and output: factors to Nm, A and rad/s, and the unit of the response."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Literal

from backend.records.response_import.errors import BadRecording
from drivers.texts import limits
from drivers.texts.message import text

InputUnit = Literal["Nm", "mNm", "A", "mA", "rated", "percent", "permille", "rad/s", "rpm", "1"]
OutputUnit = Literal["rad/s", "rpm", "rev/s", "deg/s", "m/s", "rad", "rev", "deg", "1"]

#: Factor to the base unit (Nm, A, rated torque, rad/s or 1), and that unit.
_INPUT: dict[str, tuple[float, str]] = {
    "Nm": (1.0, "Nm"), "mNm": (1e-3, "Nm"), "A": (1.0, "A"), "mA": (1e-3, "A"),
    "rated": (1.0, "rated"), "percent": (1e-2, "rated"), "permille": (1e-3, "rated"),
    "rad/s": (1.0, "rad/s"), "rpm": (2 * pi / 60, "rad/s"), "1": (1.0, "1"),
}  # fmt: skip
_OUTPUT: dict[str, tuple[float, str]] = {
    "rad/s": (1.0, "rad/s"), "rpm": (2 * pi / 60, "rad/s"), "rev/s": (2 * pi, "rad/s"),
    "deg/s": (pi / 180, "rad/s"), "m/s": (1.0, "m/s"), "rad": (1.0, "rad"), "rev": (2 * pi, "rad"),
    "deg": (pi / 180, "rad"), "1": (1.0, "1"),
}  # fmt: skip


@dataclass(frozen=True)
class Scale:
    """Factors of both signals and the unit of the response.

    ``torque``: whether the input is a torque; ``speed``: whether the output is an angular speed.
    """

    factor_in: float
    factor_out: float
    unit: str
    torque: bool
    speed: bool


def scale_of(
    input_unit: str,
    output_unit: str,
    rated_torque_nm: float | None,
    torque_constant_nm_a: float | None,
    unit: str | None,
) -> Scale:
    """Factors by which both signals are multiplied, with the unit of the response.

    A current becomes a torque by the torque constant, a share of the rated torque by the rated
    torque; ``unit`` replaces the text of the response's unit.


    Raises:
        BadRecording: an unknown unit, or a constant that does not fit it.
    """
    for use, given, known in (("input", input_unit, _INPUT), ("output", output_unit, _OUTPUT)):
        if given not in known:
            raise BadRecording(
                "import.unit-not-known",
                parameter=f"{use}-unit",
                value=given,
                limit=", ".join(known),
                use=use,
            )
    factor, kind = _INPUT[input_unit]
    out, moved = _OUTPUT[output_unit]
    for what, value, needs in (
        ("rated-torque", rated_torque_nm, "rated"),
        ("torque-constant", torque_constant_nm_a, "A"),
    ):
        if value is None:
            continue
        if not 0.0 < value < 1e6:
            raise BadRecording(
                "import.detail",
                parameter=what,
                value=value,
                limit=limits.above_zero(),
                what=text("import.value", name=what),
            )
        if kind != needs:
            raise BadRecording(
                "import.says-nothing-input",
                parameter=what,
                value=value,
                limit="rated, percent, permille" if needs == "rated" else "A, mA",
                what=text("import.value", name=what),
                input_unit=input_unit,
            )
        factor, kind = factor * value, "Nm"
    ratio = "1" if kind == moved else f"({moved})/{'rated torque' if kind == 'rated' else kind}"
    ratio = ratio if ratio != "(rad/s)/1" else "rad/s"
    return Scale(factor, out, unit or ratio, kind == "Nm", moved == "rad/s")
