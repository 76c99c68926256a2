"""Texts of an inertia measurement, English and Chinese, and its section of a report."""

from __future__ import annotations

from backend.tools.mechanics.inertia.result import InertiaAnswer
from backend.tools.tool import Note, Row, Section

TEXTS: dict[str, tuple[str, str]] = {
    "help": (
        "Measure inertia and friction and write them as JSON. The axis moves.",
        "测量惯量与摩擦并写为 JSON。轴会运动。",
    ),
    "field.scheme": ("How it may travel", "运动方式"),
    "field.ends_rev": ("Taught ends", "示教两端"),
    "field.search_torque": ("Torque for the search", "搜索转矩"),
    "field.search_speed": ("Speed for the search", "搜索速度"),
    "field.repetitions": ("Repetitions", "重复次数"),
    "field.motor_inertia_kgm2": ("Motor alone", "仅电机"),
    "inertia": ("Inertia of motor and load", "电机与负载惯量"),
    "load_ratio": ("Inertia ratio", "惯量比"),
    "coulomb": ("Coulomb friction", "库仑摩擦"),
    "viscous": ("Viscous friction", "粘性摩擦"),
    "gravity": ("Gravity", "重力"),
    "place": (
        "Position-dependent torque (spring, arm, imbalance), ±",
        "随位置变化的转矩（弹簧、摆臂、不平衡），±",
    ),
    "fan": (
        "Torque by the square of the speed (fan, pump), max.",
        "与速度平方成正比的转矩（风机、泵），最大",
    ),
    "identified": ("identified; R² {r2}", "已辨识；R² {r2}"),
    "unidentified": ("not identified: {why}", "未辨识：{why}"),
    "per_rated": (
        "The rated torque is not known: torques are shares of it.",
        "额定转矩未知：转矩以其份额表示。",
    ),
}


def report(result: InertiaAnswer) -> Section:
    """Verdict and quantities."""
    si, ci95 = result.unit == "SI", result.ci95
    rows = [
        Row("inertia", result.inertia_kgm2, "kg·m²" if si else "", ci95.inertia_kgm2),
        Row("load_ratio", result.load_ratio, "", ci95.load_ratio),
        Row("coulomb", result.coulomb_nm, "N·m" if si else "", ci95.coulomb_nm),
        Row("viscous", result.viscous_nms, "N·m·s/rad" if si else "", ci95.viscous_nms),
        Row("gravity", result.gravity_nm, "N·m" if si else "", ci95.gravity_nm),
    ]
    terms = (("place", result.place_nm), ("fan", result.fan_nm))
    rows += [Row(name, value, "N·m" if si else "") for name, value in terms if value is not None]
    verdict = (
        Note("identified", "good", {"r2": f"{result.r2:.4f}"})
        if result.identifiable
        else Note("unidentified", "warn", {"why": result.verdict})
    )
    return Section((verdict, *(() if si else (Note("per_rated"),))), tuple(rows))
