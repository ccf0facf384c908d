"""The sentences of a report that other rooms of reconcile write: notes, and the next experiment."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from diagnosis_texts import rotary_text
from message_templates import numbered, template_of, texts_inside

import reconcile
from reconcile.catalogue.registry import CATALOGUE
from reconcile.report.experiment_text import PHRASES

ROOM = Path(reconcile.__file__).parent
EXPERIMENTS = (
    *(ROOM / "design" / f"{name}.py" for name in ("excitations", "manual_experiment", "next_experiment")),
    ROOM / "report" / "experiment_text.py",
)
NOTES = (
    *sorted((ROOM / "sensing").glob("*.py")),
    *sorted((ROOM / "model_update").glob("*.py")),
    *(ROOM / "recording" / f"{name}.py" for name in ("pieces", "recording", "sensor_finding")),
    ROOM / "replay" / "model_replays.py",
    ROOM / "diagnosis" / "axis_diagnosis.py",
    ROOM / "proof" / "model_variants.py",
    ROOM / "regression" / "thinning.py",
)
CATALOGUE_FILES = tuple(sorted((ROOM / "catalogue").glob("*.py")))
NAMES = {"one by one", "added mass", "third sensor", "slow speeds", "light chirp", "small strokes"}
NAMES |= {"fast moves", "long strokes", "a bit of each"}
NAMES |= {"axis {0}: force", "axis {0}: scale less motor", "axis {0}: proof"}
"""Names of motions, experiments and steps of a diagnosis, which no report shows."""
PLACED = {"{0} [{1} to {2} s]", "axis {0}, {1}, {2} s"}
"""Names of a part of a recording, whose pieces are translated."""
WORDS = {"the position is in {0} but was read as {1}", "temperature", "both", "filled in", "axis {0}"}
"""Short texts that sentences insert."""
_PLACE = re.compile(r"\{\d?\}")
_PATTERN = re.compile(r"\\|\[\^")


def report_sentences() -> set[str]:
    """Return the templates {0}, {1} ... of these sentences, with those of rotary axes."""
    found = {"{0} from {1}", *(text.replace("{}", "{0}") for text in PHRASES.values())}
    found |= {entry.shown_by for entry in CATALOGUE.values()}
    found |= {rival.distinguished_by for entry in CATALOGUE.values() for rival in entry.rivals}
    found |= {text for path in EXPERIMENTS for text in _texts(_module(path))}
    notes = [text for path in NOTES for text in _texts(_module(path))]
    notes += [text for path in CATALOGUE_FILES for node in _noted(path) for text in _texts(node)]
    found |= {piece for text in notes for piece in _pieces(text)}
    shown = {text for text in found if text not in {"", "{0}"} and "{}" not in text} - NAMES - PLACED | WORDS
    return shown | {rotary_text(text) for text in shown}


def _pieces(text: str) -> list[str]:
    """Return the parts of a note, which is divided at its semicolons before it is recognised."""
    pieces = [text] if "(x " in text else text.split("; ")  # a count stands around a whole note
    return [numbered(piece.strip(" ;:.,")) for piece in pieces]


def _module(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


def _noted(path: Path) -> Iterator[ast.AST]:
    """Yield what an entry of the catalogue notes about the model that it writes."""
    for node in ast.walk(_module(path)):
        called = isinstance(node, ast.Call) and ast.unparse(node.func) == "notes.append"
        if called or (isinstance(node, ast.AugAssign) and ast.unparse(node.target) == "notes"):
            yield node


def _texts(node: ast.AST) -> Iterator[str]:
    left_out = {id(one.value) for one in ast.walk(node) if isinstance(one, ast.Expr)}
    for part in ast.walk(node):
        left_out |= texts_inside(part)
    for part in ast.walk(node):
        text = "" if id(part) in left_out else template_of(part).strip(" ;:.,")
        if " " in _PLACE.sub("", text).strip() and not _PATTERN.search(text):
            yield text
