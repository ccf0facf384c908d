"""The templates of the controller's messages, read from its code: events, reasons and refusals."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import servo_ctrl
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage

ROOM = Path(servo_ctrl.__file__).parent
SOURCES = (
    *sorted(path for path in (ROOM / "daemon").rglob("*.py") if path.name != "report.py"),
    ROOM / "axis" / "axis_watch.py",
    ROOM / "canopen" / "boot.py",
    ROOM / "canopen" / "watch.py",
    ROOM / "commands" / "settings.py",
    ROOM / "commands" / "stage.py",
    ROOM / "cyclic" / "sequence.py",
    ROOM / "hmi" / "link" / "machine_link.py",
)
"""Sources of events, reasons and refusals. Messages of loaders about a file stay English."""
ARGUMENTS = {"positive", "negative", "stroke", "pulse", "screw", "waveform", "{0} (node {1})"}
"""Single words and names that messages insert, besides the states of machine and learning."""
UNITS = {"mm", "um", "ms"}
LOGGERS = {"info", "warning", "exception", "error", "debug", "strftime"}
_WORD = re.compile(r"[A-Za-z]{2,}")


def _template(node: ast.AST) -> str:
    """Return a text with {0}, {1} ... for its arguments; "" for a node that is no text."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if not isinstance(node, ast.JoinedStr):
        return ""
    parts, places = [], 0
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value))
        else:
            parts.append(f"{{{places}}}")
            places += 1
    return "".join(parts)


def _spoken(module: ast.Module) -> Iterator[ast.AST]:
    """Yield texts in functions and constants of the module, but no docstrings, exceptions or log messages."""
    left_out: set[int] = set()
    for node in ast.walk(module):
        logs = isinstance(node, ast.Call) and getattr(node.func, "attr", "") in LOGGERS
        if logs or isinstance(node, ast.Raise | ast.Assert):
            left_out |= {id(part) for part in ast.walk(node)}
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            left_out.add(id(node.value))
        elif isinstance(node, ast.JoinedStr):
            left_out |= {id(part) for part in ast.walk(node) if part is not node}
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from (part for part in ast.walk(node) if id(part) not in left_out)
    for node in module.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            called = [
                part for call in ast.walk(node.value) if isinstance(call, ast.Call) for part in ast.walk(call)
            ]
            left_out |= {id(part) for part in called}
            yield from (part for part in ast.walk(node.value) if id(part) not in left_out)


def message_templates() -> set[str]:
    """Return the texts with {0}, {1} ... for their arguments, and the words that are inserted."""
    found = {stage.words for stage in Stage} | {state.name.lower() for state in LearningState} | ARGUMENTS
    for path in SOURCES:
        for node in _spoken(ast.parse(path.read_text(encoding="utf-8"))):
            text = _template(node).strip(" ;:,")
            words = set(_WORD.findall(text)) - UNITS
            if " " in text and len(words) >= (1 if isinstance(node, ast.JoinedStr) else 2):
                found.add(text)
    return found
