"""Every message has its words in both languages, and every text is somebody's."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest
from fluent.syntax import ast as ftl
from fluent.syntax import parse
from fluent.syntax.visitor import Visitor

from drivers.errors import DriveError
from drivers.texts.message import REMEDY, RENAMED, Language, Text, is_code
from drivers.texts.render import CATALOGUE, bundle, files, identifier, render

ROOT = Path(__file__).parents[2]
LANGUAGES: tuple[Language, ...] = ("en", "zh")
#: Codes made of a room and a number: tables of the standards.
TABLES = {
    "al-status.x": ROOT / "drivers/ethercat/wire/al_status.py",
    "sdo-abort.x": ROOT / "drivers/objects/sdo_abort.py",
    "ethercat.foe-": ROOT / "drivers/ethercat/wire/foe.py",
}
#: Codes that are put together from parts.
_MADE = re.compile(r"sdo-abort\.(unknown-)?(read|write)-refused(-of)?")


def _kinds_of(error: type[DriveError]) -> set[type[DriveError]]:
    for module in ("backend.api.app", "backend.commands.server.serve", "backend.cli"):
        import_module(module)
    found = {error}
    for kind in error.__subclasses__():
        found |= _kinds_of(kind)
    return found


class _Variables(Visitor):
    """Names of the variables of a pattern."""

    def __init__(self) -> None:
        self.names: set[str] = set()

    def visit_VariableReference(self, node: ftl.VariableReference) -> None:  # noqa: N802
        self.names.add(node.id.name)


def _entries(language: Language) -> dict[str, set[str]]:
    """By code (with ``/remedy`` behind it for a remedy) the variables of its text."""
    found: dict[str, set[str]] = {}
    for place in files().values():
        source = place.with_name(f"{place.name}.{language}.ftl").read_text("utf-8")
        for entry in parse(source).body:
            assert not isinstance(entry, ftl.Junk), f"{place.name}.{language}: {entry.content}"
            if not isinstance(entry, ftl.Message):
                continue
            code = entry.id.name.replace("_", ".")
            assert code not in found, f"{code} is there twice"
            for name, pattern in (
                (code, entry.value),
                *((f"{code}/{each.id.name}", each.value) for each in entry.attributes),
            ):
                if pattern is not None:
                    variables = _Variables()
                    variables.visit(pattern)
                    found[name] = variables.names
    return found


ENGLISH, CHINESE = _entries("en"), _entries("zh")
ERRORS = {each.__name__ for each in _kinds_of(DriveError)}
#: Functions that make a message of a code.
_MAKERS = {"text", "Text", "print_text", "note", "words_of", "ImportFailed", *ERRORS}
#: Functions of an import's report that take a place before the code.
_REPORTING = {"repaired", "left_out", "noted"}


class _Source(NamedTuple):
    """A module of the product: its tree, and of all its nodes the two kinds that are asked for."""

    name: str
    tree: ast.Module
    calls: list[ast.Call]
    strings: set[str]


@cache
def _sources() -> list[_Source]:
    """Every module once: walking all of them takes seconds."""
    found = []
    for folder in ("backend", "drivers", "profiles"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            tree = ast.parse(file.read_text("utf-8"))
            calls: list[ast.Call] = []
            strings: set[str] = set()
            for node in ast.walk(tree):
                if isinstance(node, ast.Call):
                    calls.append(node)
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    strings.add(node.value)
            found.append(_Source(str(file.relative_to(ROOT)), tree, calls, strings))
    return found


def _code_of(node: ast.Call) -> ast.expr | None:
    """The argument that is a message's code; None where the call makes no message."""
    called = _called(node)
    if called in _MAKERS and node.args:
        return node.args[0]
    return node.args[1] if called in _REPORTING and len(node.args) > 1 else None


def _raised() -> set[str]:
    return {words for source in _sources() for words in source.strings if is_code(words)}


def _shown() -> set[str]:
    """What errors and messages are made of: `NotAllowed("…")`, `text("…")`."""
    made = (_code_of(node) for source in _sources() for node in source.calls)
    return {
        node.value
        for node in made
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and is_code(node.value)
    }


def test_a_room_has_one_file() -> None:
    found = sorted(CATALOGUE.rglob("*.en.ftl"))
    assert len({each.name for each in found}) == len(found), "one would hide the other"


def test_every_code_has_words() -> None:
    shown = _shown()
    assert len(shown) > 500
    assert not shown - set(ENGLISH), "in no file of texts/catalogue"


def _calls() -> Iterator[tuple[str, ast.Call, str]]:
    """Every call that begins with a code: where it is, the call, the code."""
    for source in _sources():
        for node in source.calls:
            for each in node.args:
                if isinstance(each, ast.Constant) and each.value in ENGLISH:
                    yield f"{source.name}:{node.lineno}", node, str(each.value)


def test_every_message_is_given_the_facts_of_its_text() -> None:
    checked, missing = 0, []
    for place, call, code in _calls():
        given = {each.arg for each in call.keywords}
        if None in given:
            continue  # facts of a map, known when it runs
        checked += 1
        lacking = (ENGLISH[code] | ENGLISH.get(f"{code}{REMEDY}", set())) - given
        if lacking:
            missing.append(f"{place} {code}: {sorted(lacking)}")
    assert checked > 500
    assert not missing, "\n".join(missing)


def test_every_text_is_shown_by_somebody() -> None:
    made = {code for code in ENGLISH if _MADE.fullmatch(code) or code.startswith(tuple(TABLES))}
    unused = {code for code in ENGLISH if REMEDY not in code} - _raised() - made
    assert not unused, "nobody raises these"


@pytest.mark.parametrize(("start", "file"), TABLES.items())
def test_every_number_of_a_table_has_its_words(start: str, file: Path) -> None:
    numbers = {
        node.value
        for each in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(each, ast.Set)
        for node in each.elts
        if isinstance(node, ast.Constant) and isinstance(node.value, int)
    }
    digits = 8 if start.startswith("sdo") else 4
    codes = {f"{start}{number:0{digits}x}" for number in numbers}
    assert len(codes) > 10
    assert codes <= set(ENGLISH)
    listed = {code for code in ENGLISH if code.startswith(start) and REMEDY not in code}
    assert listed - codes <= {"ethercat.foe-other"}


def test_both_languages_say_the_same_codes_with_the_same_facts() -> None:
    assert set(ENGLISH) == set(CHINESE)
    differ = {code for code, facts in ENGLISH.items() if CHINESE[code] != facts}
    assert not differ


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_code_is_rendered(language: Language) -> None:
    for code, names in (ENGLISH if language == "en" else CHINESE).items():
        for number in (1, 2.5):
            facts = {name: f"‹{name}›" if name == "quantity" else number for name in names}
            found = bundle(code.partition(".")[0], language)
            assert found is not None
            assert found.has_message(identifier(code.partition("/")[0]))
            shown = render(Text(code, facts), language)
            assert shown.strip(), code
            assert "{" not in shown.replace('{"', ""), f"{code}: {shown}"
            assert "\u2068" not in shown, "no isolating signs"


def test_files_of_earlier_versions_open_with_their_sentences() -> None:
    params = {"drive": "Axis 1", "detail": "phase margin 20°"}
    stored = {"code": "autotune.no-candidate-kept-promise", "params": params}
    opened = Text.from_wire(stored)
    assert opened == Text("autotune.no-candidate-verified", params)
    assert "no design met its prediction" in opened.words()
    remedy = Text.from_wire({"code": "autotune.no-candidate-kept-promise/remedy", "params": params})
    assert remedy.words() == str(opened.remedy())
    slower = {"code": "autotune.promise-not-kept", "params": {}}
    inner = {"code": "autotune.slower-than-it-was", "params": {"share": 0.5, "why": slower}}
    assert "did not confirm its prediction" in Text.from_wire(inner).words()


def test_the_page_knows_the_same_earlier_names() -> None:
    page = (ROOT / "webui/src/i18n/message.ts").read_text("utf-8")
    listed = dict(re.findall(r"^  '([a-z.-]+)': '([a-z.-]+)',$", page, re.MULTILINE))
    assert listed == RENAMED
    assert set(RENAMED.values()) <= set(ENGLISH)
    assert not set(RENAMED) & set(ENGLISH)


def test_chinese_is_chinese() -> None:
    bare = [
        code
        for code, names in CHINESE.items()
        if not re.search(r"[\u4e00-\u9fff]", render(Text(code, dict.fromkeys(names, "x")), "zh"))
        and re.search(r"[a-z]{3}", render(Text(code, dict.fromkeys(names, "x")), "en"))
    ]
    assert not bare


def _is_sentence(node: ast.expr) -> bool:
    """A literal that is no code, or words put together in the code."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, str) and not is_code(node.value)
    by_str = isinstance(node, ast.Call) and getattr(node.func, "id", "") == "str"
    return by_str or isinstance(node, ast.JoinedStr | ast.BinOp)


def _called(node: ast.AST) -> str:
    """The name of what is called; empty where nothing is."""
    if not isinstance(node, ast.Call):
        return ""
    return str(getattr(node.func, "id", getattr(node.func, "attr", "")))


@pytest.mark.long
def test_no_error_carries_a_sentence() -> None:
    """What an error says and advises comes from the catalogue, so that it has both languages."""
    found = []
    for source in _sources():
        kinds = (node for node in ast.walk(source.tree) if isinstance(node, ast.ClassDef))
        own = (
            node
            for kind in kinds
            if kind.name in ERRORS
            for node in ast.walk(kind)
            if _called(node) == "__init__"
        )
        for node in (*(each for each in source.calls if _called(each) in ERRORS), *own):
            assert isinstance(node, ast.Call)
            advice = [each.value for each in node.keywords if each.arg == "remedy"]
            if any(_is_sentence(each) for each in (*node.args[:1], *advice)):
                found.append(f"{source.name}:{node.lineno}")
    assert not found, "\n".join(found)


def test_no_import_reports_a_sentence() -> None:
    """Findings of the importer and its errors are codes, with the facts in named arguments."""
    calls = [
        (f"{source.name}:{node.lineno}", node)
        for source in _sources()
        if source.name.startswith("profiles/importer/")
        for node in source.calls
        if _called(node) in {"ImportFailed", *_REPORTING}
    ]
    assert len(calls) > 80
    found = [
        place
        for place, node in calls
        if (code := _code_of(node)) is None
        or _is_sentence(code)
        or len(node.args) > (1 if _called(node) == "ImportFailed" else 2)
    ]
    assert not found, "\n".join(found)
    codes = {
        words
        for source in _sources()
        if source.name.startswith("profiles/")
        for words in source.strings
        if is_code(words) and words.startswith(("description.", "profile-check."))
    }
    assert codes <= set(ENGLISH), "in no file of texts/catalogue"
