"""The messages of the controller in the languages of the page: no template lacks one in a catalogue."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import servo_ctrl
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.languages.controller_messages import controller_catalogue, controller_text
from servo_ctrl.hmi.languages.texts import ENGLISH, LANGUAGES, CurrentLanguage

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
"""Where events, reasons and refusals are written. What a loader says of a file stays English."""
ARGUMENTS = {"positive", "negative", "stroke", "{0} (node {1})"}
"""Single words and names that stand in messages, beside the states of machine and learning."""
UNITS = {"mm", "um", "ms"}
LOGGERS = {"info", "warning", "exception", "error", "debug", "strftime"}
_WORD = re.compile(r"[A-Za-z]{2,}")


def template(node: ast.AST) -> str:
    """A text with {0}, {1} ... for what is put in; "" for no text."""
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


def spoken(module: ast.Module) -> Iterator[ast.AST]:
    """Texts in functions, and constants of the module: without docstrings, and what is raised or logged."""
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


def templates() -> set[str]:
    found = {stage.words for stage in Stage} | {state.name.lower() for state in LearningState} | ARGUMENTS
    for path in SOURCES:
        for node in spoken(ast.parse(path.read_text(encoding="utf-8"))):
            text = template(node).strip(" ;:,")
            words = set(_WORD.findall(text)) - UNITS
            if " " in text and len(words) >= (1 if isinstance(node, ast.JoinedStr) else 2):
                found.add(text)
    return found


@pytest.mark.parametrize("language", [code for code in LANGUAGES if code != ENGLISH])
def test_every_message_of_the_controller_is_in_every_catalogue(language: str) -> None:
    there, wanted = set(controller_catalogue(language)), templates()
    missing, unused = sorted(wanted - there), sorted(there - wanted)
    assert not missing, "\n".join(missing)
    assert not unused, "\n".join(unused)
    entries = controller_catalogue(language).items()
    assert not [english for english, shown in entries if places(english) != places(shown)]


def places(text: str) -> list[str]:
    return sorted(re.findall(r"\{\d\}", text))


@pytest.mark.parametrize(
    ("english", "german"),
    [
        (
            "axis x: following error of 1.203 mm exceeds 1 mm; short circuit",
            "Achse x: Schleppfehler von 1.203 mm übersteigt 1 mm; Kurzschluss",
        ),
        (
            "axis.x.drive (node 1): no heartbeat in 300 cycles",
            "axis.x.drive (Knoten 1): kein Heartbeat in 300 Takten",
        ),
        ("the machine is quick stopping, not ready", "die Maschine ist im Schnellhalt, nicht bereit"),
        (
            "axis y: J 7.6 um -> 2.1 um, 12 strokes, version 3 in use",
            "Achse y: J 7.6 µm -> 2.1 µm, 12 Hübe, Version 3 in Gebrauch",
        ),
        (
            "axis z: the drive did not finish homing in 60 s",
            "Achse z: der Antrieb hat die Referenzfahrt in 60 s nicht beendet",
        ),
        ("anna: enable", "anna: enable"),
        ("x; " * 600, "x; " * 600),
    ],
)
def test_a_message_is_shown_in_german_with_its_arguments(
    monkeypatch: pytest.MonkeyPatch, english: str, german: str
) -> None:
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    assert controller_text(english) == german
    assert controller_text(english, ENGLISH) == english.replace(" um", " \N{MICRO SIGN}m")
