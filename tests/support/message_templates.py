"""The templates of the controller's messages, read from its code: events, reasons, errors of files."""

import ast
import os
import re
from collections.abc import Iterator
from errno import EACCES, EEXIST, EISDIR, ENOENT, ENOSPC, ENOTDIR, EROFS
from pathlib import Path

from pydantic_core import PydanticKnownError

import servo_ctrl
from kernels.validation_messages import plain_message
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.file_format import ADVICE
from servo_ctrl.config.load import FILE_KINDS, FOREIGN_SUFFIXES
from servo_ctrl.config.program import REPORTED_UNITS
from servo_ctrl.motion.gcode.words import G_CODES, M_CODES, Effect

PACKAGE = Path(servo_ctrl.__file__).parent
_ARGUMENT = re.compile(r"\{\d\}")
SOURCES = (
    *sorted(path for path in (PACKAGE / "daemon").rglob("*.py") if path.name != "report.py"),
    PACKAGE / "axis" / "axis_watch.py",
    PACKAGE / "canopen" / "boot.py",
    PACKAGE / "canopen" / "watch.py",
    PACKAGE / "commands" / "objections.py",
    PACKAGE / "commands" / "settings.py",
    PACKAGE / "commands" / "stage.py",
    PACKAGE / "cyclic" / "drive_phases.py",
    PACKAGE / "cyclic" / "sequence.py",
    PACKAGE / "learning" / "temperature_input.py",
    PACKAGE / "hmi" / "shell" / "program_jobs.py",
    PACKAGE / "hmi" / "shell" / "program_process.py",
    PACKAGE / "hmi" / "tuning" / "page_tunings.py",
    PACKAGE / "tuning" / "controller_runs.py",
    PACKAGE / "tuning" / "request.py",
    PACKAGE / "tuning" / "session.py",
    PACKAGE / "tuning" / "simulated.py",
    PACKAGE / "hmi" / "link" / "machine_link.py",
)
"""Sources of events, reasons and refusals."""
COMMAND_LINE_ONLY = {"key_tables", "machine_files", "machine_sheet", "realtime", "section"}
"""Modules of the rooms below whose errors no page shows."""
LOADERS = (
    *sorted((PACKAGE / "config").glob("*.py")),
    *sorted((PACKAGE / "motion" / "gcode").glob("*.py")),
    *(
        PACKAGE / "control" / "compensation" / f"{name}.py"
        for name in ("fuzzy_pd", "notch", "sampled_dual_loop")
    ),
)
"""Sources of errors and objections about a machine file or a program."""
RAISING = (
    PACKAGE / "hmi" / "diagnosis" / "diagnoses.py",
    *sorted((PACKAGE / "files").glob("*.py")),
    *sorted((PACKAGE / "learned").glob("*.py")),
    *sorted((PACKAGE / "learning").glob("*.py")),
    *sorted((PACKAGE / "daemon").rglob("*.py")),
    *(PACKAGE / "canopen" / f"{name}.py" for name in ("boot", "node", "pdo")),
    *sorted((PACKAGE / "tuning").glob("*.py")),
    *sorted((PACKAGE / "excitation").glob("*.py")),
    PACKAGE / "recording" / "recorder.py",
    *(path for path in sorted((PACKAGE / "hmi").rglob("*.py")) if path.parent.name != "access"),
)
"""Sources whose errors become a reason, a refusal or a notice of the page."""
ARGUMENTS = {"positive", "negative", "stroke", "pulse", "screw", "waveform", "{0} (node {1})", "up", "down"}
"""Single words and names that messages insert, besides the states of machine and learning."""
PYDANTIC = {
    "greater_than": {"gt": 0},
    "greater_than_equal": {"ge": 0},
    "less_than": {"lt": 0},
    "less_than_equal": {"le": 0},
    "finite_number": {},
    "float_type": {},
    "int_type": {},
    "string_type": {},
    "bool_type": {},
    "list_type": {},
    "dict_type": {},
    "model_type": {"class_name": "x"},
    "string_pattern_mismatch": {"pattern": "x"},
    "too_short": {"field_type": "x", "min_length": 0, "actual_length": 0},
    "too_long": {"field_type": "x", "max_length": 0, "actual_length": 0},
}
"""Kinds of errors that pydantic makes of our types."""
TOML_READER = {
    "{0} (at line {1}, column {2})",
    "{0} (at end of document)",
    "Invalid statement",
    "Invalid value",
    "Expected newline or end of document after a statement",
    "Expected '=' after a key in a key/value pair",
    "Cannot declare {0} twice",
    "Cannot overwrite a value",
    "Unclosed array",
    "Unterminated string",
    "Invalid initial character for a key part",
}
"""Messages of tomllib about frequent mistakes."""
UNITS = {"mm", "um", "ms"}
LOGGERS = {"info", "warning", "exception", "error", "debug", "strftime"}
_WORD = re.compile(r"[A-Za-z]{2,}")


def template_of(node: ast.AST) -> str:
    """Return a text with {0}, {1} ... for its arguments; "" for a node that is not a text."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if not isinstance(node, ast.JoinedStr):
        return ""
    parts, count = [], 0
    for part in node.values:
        if isinstance(part, ast.Constant):
            parts.append(str(part.value))
        else:
            parts.append(f"{{{count}}}")
            count += 1
    return "".join(parts)


def numbered(text: str) -> str:
    """Return the template with its arguments counted from 0, after a part of it was cut off."""
    order: dict[str, str] = {}
    return _ARGUMENT.sub(lambda place: order.setdefault(place[0], f"{{{len(order)}}}"), text)


def texts_inside(node: ast.AST) -> set[int]:
    """Return the ids of the pieces of a formatted text, which are not texts of their own."""
    return (
        {id(part) for part in ast.walk(node) if part is not node}
        if isinstance(node, ast.JoinedStr)
        else set()
    )


def _reported_texts(module: ast.Module) -> Iterator[ast.AST]:
    """Yield texts in functions and constants of the module, but no docstrings, exceptions or log messages."""
    excluded: set[int] = set()
    for node in ast.walk(module):
        logs = isinstance(node, ast.Call) and getattr(node.func, "attr", "") in LOGGERS
        if logs or isinstance(node, ast.Raise | ast.Assert):
            excluded |= {id(part) for part in ast.walk(node)}
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            excluded.add(id(node.value))
        excluded |= texts_inside(node)
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from (part for part in ast.walk(node) if id(part) not in excluded)
    for node in module.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            called = [
                part for call in ast.walk(node.value) if isinstance(call, ast.Call) for part in ast.walk(call)
            ]
            excluded |= {id(part) for part in called}
            yield from (part for part in ast.walk(node.value) if id(part) not in excluded)


def _objection_texts(module: ast.Module) -> Iterator[ast.AST]:
    """Yield texts in functions, exceptions too, but no docstrings, names in tables, or labels of steps."""
    excluded: set[int] = set()
    for node in ast.walk(module):
        looked_up = isinstance(node, ast.Compare | ast.Subscript | ast.Set | ast.Assert)
        called = node.func if isinstance(node, ast.Call) else None
        named = getattr(called, "attr", getattr(called, "id", ""))
        if looked_up or named in LABELLED:
            excluded |= {id(part) for part in ast.walk(node)}
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            excluded.add(id(node.value))
        excluded |= texts_inside(node)
    for node in ast.walk(module):
        if isinstance(node, ast.FunctionDef):
            yield from (part for part in ast.walk(node) if id(part) not in excluded)


LABELLED = {"compile", "sub", "Dwell", "Move", "ScrewTravel", "Remark", "pop"}
"""Calls whose texts are not messages: patterns, labels of steps, remarks of `servo-ctrl check`."""


def _raised_texts(module: ast.Module) -> Iterator[ast.AST]:
    """Yield texts of exceptions that are not translated where they are raised."""
    for node in ast.walk(module):
        if not isinstance(node, ast.Raise):
            continue
        excluded: set[int] = set()
        for part in ast.walk(node):
            excluded |= texts_inside(part)
            if isinstance(part, ast.Call) and getattr(part.func, "id", "") == "tr":
                excluded |= {id(inner) for inner in ast.walk(part)}
        yield from (part for part in ast.walk(node) if id(part) not in excluded)


def _messages(nodes: Iterator[ast.AST]) -> set[str]:
    """Return the templates of the texts that are sentences: two words, or one beside an argument."""
    found = set()
    for node in nodes:
        text = template_of(node).strip(" ;:,")
        words = set(_WORD.findall(text)) - UNITS
        if " " in text and len(words) >= (1 if isinstance(node, ast.JoinedStr) else 2):
            found.add(text)
    return found


def _module(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _inserted_words() -> set[str]:
    """Return what loaders insert from their tables, and the messages of the libraries that they call."""
    refused = [code for code in (*G_CODES.values(), *M_CODES.values()) if code.effect is Effect.REFUSED]
    library = set()
    for kind, context in PYDANTIC.items():
        text = PydanticKnownError(kind, context or None).message_template  # type: ignore[arg-type]  # kinds are literals there
        for number, field in enumerate(re.findall(r"\{\w+\}", text)):
            text = text.replace(field, f"{{{number}}}", 1)
        library.add(plain_message(text))
    return (
        {code.meaning for code in refused}
        | set(FILE_KINDS.values())
        | set(FOREIGN_SUFFIXES.values()) - {"G-code"}
        | {ADVICE}
        | {f"{quantity} {{0}}" for quantity in REPORTED_UNITS}
        | {os.strerror(number) for number in (EACCES, EEXIST, EISDIR, ENOENT, ENOSPC, ENOTDIR, EROFS)}
        | {"[Errno {0}] {1}"}
        | library
        | TOML_READER
    )


def message_templates() -> set[str]:
    """Return the texts with {0}, {1} ... for their arguments, and the words that are inserted."""
    found = {stage.words for stage in Stage} | {state.name.lower() for state in LearningState} | ARGUMENTS
    for path in SOURCES:
        found |= _messages(_reported_texts(_module(path)))
    for path in LOADERS:
        if path.stem not in COMMAND_LINE_ONLY:
            found |= _messages(_objection_texts(_module(path)))
    for path in RAISING:
        if path.stem not in COMMAND_LINE_ONLY:
            found |= _messages(_raised_texts(_module(path)))
    return found | _inserted_words()
