"""Every text of the pages is in every catalogue, and no catalogue has a text that no page shows."""

import ast
import re
import string
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path

import pytest
from diagnosis_texts import diagnosis_texts
from message_templates import message_templates
from report_texts import report_texts

import servo_ctrl.hmi
from servo_ctrl.hmi.drive.faults import CODES, REASONS, UNKNOWN_CODE, UNKNOWN_REASON
from servo_ctrl.hmi.languages.texts import ENGLISH, LANGUAGES, CurrentLanguage, catalogue, chosen_language, tr
from servo_ctrl.hmi.motion.step_fields import MODELS, WITHOUT_FORM, fields_of

ROOM = Path(servo_ctrl.hmi.__file__).parent
MARKS = {"tr", "word"}
TEXT_ARGUMENTS = {
    "label": {0},
    "faint": {0},
    "card": {0},
    "panel": {0},
    "button": {0},
    "notify": {0},
    "confirmed": {0, 1, 2},
    "choice": {1},
    "captioned": {0, 1},
    "checkbox": {0},
    "switch": {0},
    "Switch": {0},
    "expansion": {0},
    "tab": {1},
    "input": {0},
    "number": {0},
    "set_text": {0},
    "tooltip": {0},
    "progress_bar": {0},
    "Plot": {1},
    "LiveChart": {1},
    "plot_layout": {0, 1},
    "value_axis": {1},
    "TextTable": {1},
    "show": {0},
}
"""Places of the arguments that a visitor reads, by the name of the function that shows them."""
NO_LANGUAGE = {"rms", "mm", "inch", "emcy", "servo", "ctrl", "min", "ms", "hz", "mqtt", "sdo"}
_WORD = re.compile(r"[A-Za-z]{2,}")


@cache
def modules() -> dict[Path, ast.Module]:
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(ROOM.rglob("*.py"))}


def called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")


def marked_texts() -> set[str]:
    texts = set(chain(UNKNOWN_CODE, UNKNOWN_REASON, *CODES.values(), *REASONS.values()))  # of advice.toml
    for kind in set(MODELS) - WITHOUT_FORM:
        for field in fields_of(kind, ["x"]):
            texts |= {field.name, field.meaning}
    for path, module in modules().items():
        for node in ast.walk(module):
            if isinstance(node, ast.Call) and called(node) in MARKS and node.args:
                first = node.args[0]
                if isinstance(first, ast.Constant) and isinstance(first.value, str):
                    texts.add(first.value)
                else:
                    assert called(node) == "tr", f"{path}:{node.lineno}: word() marks a text, not a value"
    return texts


def plain_texts(node: ast.AST) -> Iterator[tuple[int, str]]:
    """Texts below a node that are not marked: with words in them, and no name of a thing."""
    if isinstance(node, ast.Call | ast.Subscript | ast.Compare | ast.Dict):
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        if any(found.lower() not in NO_LANGUAGE for found in _WORD.findall(node.value)):
            yield node.lineno, node.value
        return
    parts = node.values if isinstance(node, ast.JoinedStr) else list(ast.iter_child_nodes(node))
    for part in parts:
        if not isinstance(part, ast.FormattedValue):
            yield from plain_texts(part)


def test_every_text_that_a_visitor_reads_is_marked_for_the_catalogues() -> None:
    unmarked = [
        f"{path.relative_to(ROOM)}:{line}: {text}"
        for path, module in modules().items()
        for node in ast.walk(module)
        if isinstance(node, ast.Call)
        for place, argument in enumerate(node.args)
        if place in TEXT_ARGUMENTS.get(called(node), set())
        for line, text in plain_texts(argument)
    ]
    assert not unmarked, "\n".join(unmarked)


@pytest.mark.parametrize("language", [code for code in LANGUAGES if code != ENGLISH])
def test_a_catalogue_has_every_text_and_no_other(language: str) -> None:
    there, wanted = set(catalogue(language)), marked_texts()
    missing, unused = sorted(wanted - there), sorted(there - wanted)
    assert not missing, "\n".join(f"{text!r}" for text in missing)
    assert not unused, "\n".join(f"{text!r}" for text in unused)


def fields(text: str) -> set[str]:
    return {f"{name}:{form}" for _, name, form, _ in string.Formatter().parse(text) if name is not None}


@pytest.mark.parametrize("language", [code for code in LANGUAGES if code != ENGLISH])
def test_a_translation_has_the_placeholders_of_the_english_text(language: str) -> None:
    entries = catalogue(language).items()
    other = [english for english, text in entries if "{" in english and fields(english) != fields(text)]
    assert not other
    assert not [english for english, text in entries if not text.strip()]


TEMPLATES = {"controller": message_templates, "diagnosis": diagnosis_texts, "report": report_texts}


@pytest.mark.parametrize("part", TEMPLATES)
@pytest.mark.parametrize("language", [code for code in LANGUAGES if code != ENGLISH])
def test_every_message_of_controller_and_diagnosis_is_in_every_catalogue(language: str, part: str) -> None:
    there, wanted = set(catalogue(language, part)), TEMPLATES[part]()
    missing, unused = sorted(wanted - there), sorted(there - wanted)
    assert not missing, "\n".join(missing)
    assert not unused, "\n".join(unused)
    entries = catalogue(language, part).items()
    assert not [english for english, shown in entries if places(english) != places(shown)]


def places(text: str) -> list[str]:
    return sorted(re.findall(r"\{\d\}", text))


def test_a_text_is_shown_in_the_language_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    assert tr("Axis {axis}", axis="x") == "Axis x"
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: "de"))
    assert tr("Axis {axis}", axis="x") == "Achse x"


@pytest.mark.parametrize(
    ("cookie", "accepted", "default", "expected"),
    [
        (None, "", None, "en"),
        (None, "de-AT,de;q=0.9,en;q=0.8", None, "de"),
        (None, "fr,en;q=0.5,de;q=0.7", None, "de"),
        (None, "de;q=0,en", None, "en"),
        (None, "de", "en", "en"),
        ("de", "en", "en", "de"),
        ("xx", "a;q=b,,;;", "yy", "en"),
    ],
)
def test_the_choice_on_the_page_goes_before_the_option_and_that_before_the_browser(
    cookie: str | None, accepted: str, default: str | None, expected: str
) -> None:
    assert chosen_language(cookie, accepted, default) == expected
