"""What the command line prints is in the language that was chosen, before or for the command."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

from backend import __version__

ROOT = Path(__file__).parents[4]
_WORDS = re.compile(r"[A-Za-z]{2,} [A-Za-z]{2,}")


def servodeck(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "backend", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={"PATH": "/usr/bin:/bin", "PYTHONWARNINGS": "error", **environment},
    )


def test_version() -> None:
    assert servodeck("--version").stdout == f"servodeck {__version__}\n"


@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "environment"),
    [(("--language", "zh"), {}), ((), {"LANG": "zh_CN.UTF-8"}), ((), {"LC_ALL": "zh_TW"})],
)
def test_errors_are_in_chinese(arguments: tuple[str, ...], environment: dict[str, str]) -> None:
    done = servodeck(*arguments, "scan", "nobus://", **environment)
    assert done.returncode == 1
    assert done.stderr.startswith("错误：'nobus://' 不是总线 URL")
    assert "\n请尝试：" in done.stderr
    assert "write it like" not in done.stderr


@pytest.mark.long
def test_option_wins_over_the_locale() -> None:
    done = servodeck("--language", "en", "scan", "nobus://", LANG="zh_CN.UTF-8")
    assert done.stderr.startswith("error: 'nobus://' is not a bus URL")


def test_unknown_language_names_the_choices() -> None:
    done = servodeck("--language", "fr", "scan", "nobus://")
    assert done.returncode == 2
    assert "'en'" in done.stderr
    assert "'zh'" in done.stderr


def _sentences(file: Path) -> list[str]:
    """Literal sentences that a module prints: two words of letters next to one another."""
    found = []
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if not isinstance(node, ast.Call) or getattr(node.func, "id", "") != "print":
            continue
        for part in (each for argument in node.args for each in ast.walk(argument)):
            if isinstance(part, ast.Constant) and _WORDS.search(str(part.value)):
                found.append(f"{file.name}:{part.lineno} {part.value}")
    return found


def test_no_command_prints_a_sentence_of_one_language() -> None:
    found = [line for file in (ROOT / "backend/commands").glob("*.py") for line in _sentences(file)]
    assert not found, "\n".join(found)
