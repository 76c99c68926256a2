"""Nothing in `backend` and `drivers` reads the words of a message to decide.

Facts are typed from where they arise; words are made for people (`docs/adr`, house rules). The
check follows texts through a function: what is an attribute such as ``.message``, ``str(error)``
of a caught error, or a name assigned from one of these is a text for people. Comparing it,
searching it, splitting it or looking it up is reading it. Whether there is a text at all
(``if text``, ``text == ""``) may be asked.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: Attributes that hold text for people, on whatever object they are.
_TEXTS = frozenset(
    {
        "message",
        "reason",
        "trouble",
        "problem",
        "remedy",
        "advice",
        "strerror",
        "note",
        "halted",
        "detail",
        "title",
        "words",
    }
)
#: Names that hold such a text by their name alone.
_NAMES = frozenset({"reason", "trouble", "problem", "why"})
_READING = frozenset(
    {
        "startswith", "endswith", "find", "rfind", "index", "rindex", "count", "split", "rsplit",
        "partition", "rpartition", "splitlines", "removeprefix", "removesuffix", "isdigit",
        "lower", "upper", "casefold", "strip", "lstrip", "rstrip", "__contains__", "__eq__",
    }
)  # fmt: skip
_LOOKING_UP = frozenset({"get", "pop", "index", "count", "__contains__", "setdefault"})

_PYSERIAL = "pyserial gives some errors of the system as nothing but its own text"
#: (file, line as it stands): why. Either an error of others that is translated at the edge and has
#: nothing but its text or number, or words that are shown and nothing else.
ALLOWED: dict[tuple[str, str], str] = {
    (
        "drivers/computer/serial_ports/terminals.py",
        "if error.args[0] == errno.EINTR:",
    ): "termios.error carries its number as its first argument only",
    (
        "drivers/computer/serial_ports/terminals.py",
        "windows = _WIN_ERROR.search(text)",
    ): _PYSERIAL,
    (
        "drivers/computer/serial_ports/terminals.py",
        'posix = re.search(r"\\[Errno (\\d+)\\]", text)',
    ): _PYSERIAL,
    (
        "drivers/modbus/port.py",
        'if number in (errno.EAGAIN, errno.EBUSY) or "exclusively lock" in text:',
    ): _PYSERIAL,
    ("drivers/modbus/port.py", 'if number == errno.EINVAL or "baud" in text:'): _PYSERIAL,
    (
        "drivers/canopen/adapters/adapter.py",
        'if code == errno.EAFNOSUPPORT or "AF_CAN" in words:',
    ): "Python without SocketCAN raises AttributeError or OSError without a number",
    (
        "backend/api/drive/routes.py",
        "reason = request.reason.strip()",
    ): "a person's own words, which must not be empty",
    (
        "backend/api/scope/recordings.py",
        "given = request.reason.strip()",
    ): "a person's own words, or none",
    (
        "backend/records/recording/library.py",
        "fitting = [s for s in found if all(word in s.words() for word in words)]",
    ): "a person searches recordings by words of their descriptions",
    (
        "backend/records/audit/trail.py",
        "for word in self.words.split():",
    ): "a person searches the audit by words",
    (
        "backend/records/library/rows.py",
        "for word in query.words.lower().split():",
    ): "a person searches the library by words",
    (
        "backend/station/recording/capture.py",
        r'words = re.sub(r"[^\w.\-]+", " ", reason, flags=re.ASCII).strip()[:50].strip(" .")',
    ): "the name of a file is made of the words; it is never parsed",
}


class _Function(ast.NodeVisitor):
    """One function or module body: which names hold texts, and where one is read."""

    def __init__(self) -> None:
        self.caught: set[str] = set()
        self.tainted: set[str] = set()
        self.found: list[ast.AST] = []

    # What is a text -------------------------------------------------------------------------

    def is_text(self, node: ast.AST | None) -> bool:
        match node:
            case ast.Attribute(attr=attr):
                return attr in _TEXTS or (attr == "args" and self._is_error(node.value))
            case ast.Name(id=name):
                return name in self.tainted or name in _NAMES
            case ast.Call(func=ast.Name(id="str" | "repr" | "format"), args=[first, *_]):
                return self._is_error(first) or self.is_text(first)
            case ast.Call(func=ast.Attribute(attr="words")):
                return True  # of a message of the catalogue
            case ast.Call(func=ast.Attribute(value=inner, attr=attr)) if attr in _READING:
                return self.is_text(inner)
            case ast.JoinedStr(values=values):
                return any(
                    isinstance(v, ast.FormattedValue)
                    and (self._is_error(v.value) or self.is_text(v.value))
                    for v in values
                )
            case ast.BinOp(left=left, right=right):
                return self.is_text(left) or self.is_text(right)
            case ast.BoolOp(values=values):
                return any(self.is_text(v) for v in values)
            case ast.IfExp(body=body, orelse=orelse):
                return self.is_text(body) or self.is_text(orelse)
            case ast.NamedExpr(value=value):
                return self.is_text(value)
            case ast.Subscript(value=value):
                return self.is_text(value)
        return False

    def _is_error(self, node: ast.AST) -> bool:
        return isinstance(node, ast.Name) and (
            node.id in self.caught or node.id in ("error", "exc", "exception", "failure")
        )

    # What reads one -------------------------------------------------------------------------

    def visit_ExceptHandler(self, node: ast.ExceptHandler) -> None:
        if node.name:
            self.caught.add(node.name)
        self.generic_visit(node)

    def visit_Assign(self, node: ast.Assign) -> None:
        self.generic_visit(node)
        pairs: list[tuple[ast.expr, ast.expr]] = []
        for target in node.targets:
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs += zip(target.elts, node.value.elts, strict=False)
            else:
                pairs.append((target, node.value))
        for target, value in pairs:
            self._assigned(target, value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self.generic_visit(node)
        self._assigned(node.target, node.value)

    def visit_NamedExpr(self, node: ast.NamedExpr) -> None:
        self.generic_visit(node)
        self._assigned(node.target, node.value)

    def _assigned(self, target: ast.expr, value: ast.expr | None) -> None:
        if isinstance(target, ast.Name) and self.is_text(value):
            self.tainted.add(target.id)

    def visit_Compare(self, node: ast.Compare) -> None:
        sides = [node.left, *node.comparators]
        presence = any(isinstance(s, ast.Constant) and s.value in ("", None) for s in sides)
        identity = all(isinstance(op, ast.Is | ast.IsNot) for op in node.ops)
        if not presence and not identity and any(self.is_text(side) for side in sides):
            self.found.append(node)
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        function = node.func
        if isinstance(function, ast.Attribute):
            owner = function.value
            reads = function.attr in _READING and self.is_text(owner)
            module = owner.id if isinstance(owner, ast.Name) else ""
            matches = module in ("re", "fnmatch") or function.attr in (
                "match",
                "search",
                "fullmatch",
                "findall",
                "finditer",
            )
            looks_up = function.attr in _LOOKING_UP and not isinstance(owner, ast.Constant)
            if reads or ((matches or looks_up) and any(self.is_text(a) for a in node.args)):
                self.found.append(node)
        self.generic_visit(node)

    def visit_Match(self, node: ast.Match) -> None:
        if self.is_text(node.subject):
            self.found.append(node)
        self.generic_visit(node)

    def visit_Subscript(self, node: ast.Subscript) -> None:
        if self.is_text(node.slice) and isinstance(node.ctx, ast.Load):
            self.found.append(node)
        self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        inner = _Function()
        inner.tainted |= self.tainted
        for each in node.body:
            inner.visit(each)
        self.found += inner.found

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        self.visit_FunctionDef(node)  # type: ignore[arg-type]


def readings(source: str) -> Iterator[int]:
    """Line numbers at which words are read."""
    visitor = _Function()
    visitor.visit(ast.parse(source))
    yield from sorted({getattr(node, "lineno", 0) for node in visitor.found})


def _all_readings() -> dict[tuple[str, str], int]:
    found: dict[tuple[str, str], int] = {}
    for folder in ("backend", "drivers"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            source = path.read_text(encoding="utf-8")
            lines = source.splitlines()
            for number in readings(source):
                found[str(path.relative_to(ROOT)), lines[number - 1].strip()] = number
    return found


def test_no_control_flow_reads_the_words_of_a_message() -> None:
    found = _all_readings()
    unknown = [
        f"{file}:{line}: {text}"
        for (file, text), line in found.items()
        if (file, text) not in ALLOWED
    ]
    assert not unknown, "decide by a type or a field instead:\n" + "\n".join(unknown)
    assert not set(ALLOWED) - set(found), "no longer there: take it off the list"


@pytest.mark.parametrize(
    "line",
    [
        'ended = "torque" in error.message',
        "ended = _OF_THE_MOTION[0] in error.message",
        'ended = "is beyond the limit" in reason',
        "ended = reason.startswith(_FELL_OUT)",
        "ended = any(words in reason for words in _OF_THE_MOTION)",
        'ended = error.message == "stopped"',
        'ended = re.search("torque", str(error))',
        'ended = _PATTERN.match(f"{error}")',
        'ended = "torque" in str(error).lower()',
        "ended = CAUSES[error.message]",
        "ended = CAUSES.get(str(error))",
        'text = str(error)\n    ended = "torque" in text',
        'text, n = error.message, 1\n    ended = text.endswith("x")',
        'if (text := error.message) and "torque" in text:\n        pass',
        'match error.message:\n        case "stopped":\n            pass',
        'ended = loop == "none" and settings.loop == "auto" and "position" in error.message',
        "ended = error.args[0] == STOPPED",
        'ended = "torque" in found.text.words()',
        'ended = halt.text.words("zh").startswith("转矩")',
        'if warning.words() == "coherence is low":\n        pass',
        'ended = self.words if self.words != "open" else "ended"',
        'ended = reported.detail.startswith("there is no drive")',
    ],
)
def test_reading_words_is_found(line: str) -> None:
    """The lines that decided about a second motion before halts were values, and their like."""
    assert list(readings(f"def f(error, reason):\n    {line}\n"))


@pytest.mark.parametrize(
    "line",
    [
        "raise NotAllowed(f'{name}: {error.message}') from error",
        "if reason:\n        return reason",
        'if error.message == "":\n        return None',
        "ended = halt.cause is HaltCause.TORQUE",
        'ended = message["op"] == "play"',
        "self._reports.append(error.message)",
    ],
)
def test_passing_words_on_is_no_reading(line: str) -> None:
    assert not list(readings(f"def f(error, reason):\n    {line}\n"))
