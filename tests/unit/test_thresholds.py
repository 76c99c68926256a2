"""Numbers that were chosen stand in a table, each with its unit and origin."""

import ast
import re
from pathlib import Path

import pytest

from benchmarks import thresholds as script

ROOT = Path(__file__).parents[2]
PACKAGES = ("backend/analysis", "backend/tools")
#: Numbers that follow from a definition: no one chose them, or they are part of an interface.
DEFINED = {
    "TURN": "2π",
    "_TURN": "2π",
    "_CI95": "95 % of a normal distribution",
    "COEFFICIENT_SCALE": "format of a drive's notch coefficients",
    "COEFFICIENT_OFFSET": "format of a drive's notch coefficients",
    "LOAD_PARAMETERS": "parameters of the model",
    "RIGID_PARAMETERS": "parameters of the model",
    "MODE_PARAMETERS": "parameters of the model",
    "_RIGID": "columns of the regression",
    "_DELAY": "place of a parameter",
    "_POSITION_DELAY": "place of a parameter",
    "_FILTER": "place of a parameter",
    "_FIRST": "place of a parameter",
    "GROUP": "numbers of parts in stored raw data",
    "_ORDER": "order of a polynomial, which the window follows from",
    "_RATIO": "logarithm of a damping ratio by those of its parts",
    "_START_HOMING": "control word, CiA 402",
    "_HOMED": "status word of DS_C",
    "_PAIR": "one realisation of each sign",
    "_NAMED": "shown in a message",
    "_POINTS": "drawn on a page",
    "_WAYS": "two directions",
    "_DIRECTIONS": "two directions",
    "DIRECTIONS": "two directions, each with every sign",
    "_WHOLE_RANGE": "2^31 of a 32-bit position",
    "_MOST_INCREMENTS": "half of the range of a 32-bit position",
    "_TURN_RPM": "60/2π",
    "_SHOWN": "rows on a page",
    "_Z95": "95 % of a normal distribution",
    "RATED_AMBIENT_C": "ambient temperature of the rated torque, IEC 60034-1",
    "STATUS": "column of the status word",
}


def _numeric(node: ast.expr) -> bool:
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return False
    each = value if isinstance(value, tuple) else (value,)
    return bool(each) and all(type(one) in (int, float) for one in each)


def _assigned(tree: ast.Module) -> list[tuple[str, ast.expr]]:
    found = []
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found.append((node.targets[0].id, node.value))
        elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Tuple):
            values = node.value.elts if isinstance(node.value, ast.Tuple) else []
            names = [n.id for n in node.targets[0].elts if isinstance(n, ast.Name)]
            found += list(zip(names, values, strict=True))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and node.value:
            found.append((node.target.id, node.value))
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_chosen_numbers_stand_in_the_table_only(package):
    outside = [
        f"{path.relative_to(ROOT)}: {name}"
        for path in sorted((ROOT / package).rglob("*.py"))
        if path.name != "thresholds.py"
        for name, value in _assigned(ast.parse(path.read_text()))
        if name.isupper() and name not in DEFINED and _numeric(value)
    ]
    assert outside == []


@pytest.mark.parametrize("package", PACKAGES)
def test_each_number_has_a_unit_an_origin_and_a_reader(package):
    table = ROOT / package / "thresholds.py"
    source = table.read_text()
    for space in (node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)):
        words = ast.get_docstring(space) or ""
        modules = re.findall(r"`(.+?\.py)`", words)
        assert modules, f"{space.name} names no module"
        code = "".join((ROOT / package / module).read_text() for module in modules)
        assert f"import {space.name} as threshold" in code
        for number, words_of in zip(space.body[1::2], space.body[2::2], strict=True):
            assert isinstance(number, ast.Assign)
            assert isinstance(words_of, ast.Expr)
            name = ast.unparse(number.targets[0])
            said = " ".join(str(ast.literal_eval(words_of.value)).split())
            assert re.match(r"\[[^\]]+\] .*Origin: \S+", said), f"{space.name}.{name}: {said}"
            explained = not said.split("] ", 1)[1].startswith("Origin") or re.search(
                rf"    # [A-Z0-9_, ]*\b{name}\b[^:]*:", source
            )
            assert explained, f"{space.name}.{name} says nothing of what it decides"
            assert f"threshold.{name}" in code, f"{space.name}.{name} is read by nobody"


def test_counts_stay_whole_and_at_least_one():
    assert script.changed(1, 0.5) == 1
    assert script.changed(5, 2.0) == 10
    assert script.changed((0.2, 4), 0.5) == (0.1, 2)


def test_an_effect_is_written_behind_its_number_and_anew():
    source = 'class a:\n    """`a.py`."""\n\n    X = 1.0\n    """[s] Told. Origin: b."""\n'
    once = script.written(source, {("a", "X"): ("no difference", "slower")})
    assert '"""[s] Told. Origin: b. Halved: no difference. Doubled: slower."""' in once
    again = script.written(once, {("a", "X"): ("faster", "slower")})
    assert again == once.replace("no difference", "faster")
