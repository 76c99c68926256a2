"""Nothing outside `drivers.computer` knows the system: held by the syntax trees of all modules."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.other_system import ABSENT, LACKING

ROOT = Path(__file__).resolve().parents[3]
ROOM = "drivers/computer/"
MODULES = ABSENT | {"ctypes", "msvcrt", "winreg", "_winapi", "signal", "platform"}
#: What asks which system this is.
ASKED = {("sys", "platform"), ("os", "name"), ("os", "uname"), ("sys", "getwindowsversion")}
#: What POSIX or Linux alone has. `select.select` of sockets exists everywhere.
NAMES = {(module, name) for module, names in LACKING.items() for name in names} | {
    ("os", name) for name in ("getpriority", "pipe2", "sched_setaffinity", "setns", "unshare")
}
PLACES = ("/proc/", "/sys/", "/etc/")
#: profiles lies beneath drivers and cannot use the room: whose file a cached profile is.
EXCEPTIONS = {"profiles/loader.py": {"sys.platform", "os.getuid"}}


def known(tree: ast.AST) -> Iterator[str]:
    """What a module knows of the system."""
    documentation = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names if one.name.partition(".")[0] in MODULES)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            if node.module.partition(".")[0] in MODULES:
                yield node.module
            for one in node.names:
                if (node.module, one.name) in ASKED | NAMES:
                    yield f"{node.module}.{one.name}"
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id, node.attr) in ASKED | NAMES:
                yield f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            if node.value.startswith(PLACES) and id(node) not in documentation:
                yield node.value
        elif isinstance(node, ast.keyword) and node.arg in ("preexec_fn", "creationflags"):
            yield node.arg


def outside() -> list[Path]:
    files = [
        file for top in ("backend", "drivers", "profiles") for file in (ROOT / top).rglob("*.py")
    ]
    return [file for file in files if not file.relative_to(ROOT).as_posix().startswith(ROOM)]


def test_no_module_outside_the_room_knows_the_system() -> None:
    found = {}
    for file in outside():
        name = file.relative_to(ROOT).as_posix()
        here = set(known(ast.parse(file.read_text("utf-8")))) - EXCEPTIONS.get(name, set())
        if here:
            found[name] = sorted(here)
    assert found == {}


def test_no_exception_is_left_over() -> None:
    for name, allowed in EXCEPTIONS.items():
        assert allowed <= set(known(ast.parse((ROOT / name).read_text("utf-8"))))


@pytest.mark.parametrize(
    "text",
    [
        "import fcntl", "from termios import error", "import sys\nsys.platform",
        "import ctypes.util",
        "from os import openpty", "import os\nos.getuid()", "p = '/proc/self/status'",
        "f'/sys/class/net/{name}'", "import signal", "subprocess.Popen(x, preexec_fn=f)",
    ],
)  # fmt: skip
def test_each_way_of_knowing_it_is_found(text: str) -> None:
    assert list(known(ast.parse(text)))


def test_a_docstring_may_speak_of_it() -> None:
    assert not list(known(ast.parse("'''/proc/self/status is read elsewhere.'''")))
