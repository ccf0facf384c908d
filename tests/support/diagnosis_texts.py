"""The texts of a diagnosis on the page, read from the code of reconcile, which the page never imports."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from message_templates import template_of, texts_inside

import reconcile
from reconcile.catalogue.registry import CATALOGUE
from reconcile.cli.diagnose_progress import steps_of
from reconcile.formats.rotary_units import sentence_of
from servo_ctrl.hmi.diagnosis.verdict import effect_name, parameter_name

ROOM = Path(reconcile.__file__).parent
ROOMS = ("catalogue", "identification")
SENTENCES = {"sentence", "explanation", "finding", "answers_late"}
"""Arguments and functions that make the explanation of a finding."""
WORDS = {"rises", "falls", "unknown"}
"""Words that explanations insert, and the effect that has no name."""
_PLACE = re.compile(r"\{(\d)\}")
_DIGIT = re.compile(r"90(\d)")


def diagnosis_texts() -> set[str]:
    """Return templates of explanations, names of effects and of their parameters, and steps."""
    modules = [ast.parse(path.read_text("utf-8")) for room in ROOMS for path in (ROOM / room).glob("*.py")]
    verdict = ast.parse((ROOM / "diagnosis" / "verdict.py").read_text("utf-8"))
    sentences = {text for module in modules for text in _sentences(module, SENTENCES)}
    sentences |= set(_sentences(verdict, {"why_not"}))
    keys = {key for module in modules for key in _parameter_keys(module)}
    keys |= {key for entry in CATALOGUE.values() for key in (*entry.coefficients, *entry.shape_parameters)}
    steps = {step.replace("axis x", "axis {0}") for step in steps_of(["x"])}
    names = {effect_name(name) for name in CATALOGUE} | {parameter_name(key) for key in keys}
    return sentences | {rotary_text(text) for text in sentences} | names | steps | WORDS


def _sentences(module: ast.Module, names: set[str]) -> Iterator[str]:
    for node in ast.walk(module):
        named = isinstance(node, ast.FunctionDef) and node.name.strip("_") in names
        given = isinstance(node, ast.keyword) and node.arg in names
        if not (named or given):
            continue
        left_out = {id(one.value) for one in ast.walk(node) if isinstance(one, ast.Expr)}
        for part in ast.walk(node):
            left_out |= texts_inside(part)
        texts = (template_of(part) for part in ast.walk(node) if id(part) not in left_out)
        yield from (text.strip(" :") for text in texts if " " in text.strip())


def _parameter_keys(module: ast.Module) -> Iterator[str]:
    """Yield the keys of dictionaries whose values are made by SiParameter."""
    for node in ast.walk(module):
        if isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                made = isinstance(value, ast.Call) and getattr(value.func, "id", "") == "SiParameter"
                if made and isinstance(key, ast.Constant):
                    yield str(key.value)


def rotary_text(text: str) -> str:
    """Return a template with the units of a rotary axis, in which reconcile writes it for one."""
    numbered = sentence_of(_PLACE.sub(r"90\1", text), rotary=True)
    return _DIGIT.sub(r"{\1}", numbered)
