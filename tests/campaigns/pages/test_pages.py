"""Generated text equals the committed text, and every claim names what is there."""

import ast
import importlib.util
import json
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer.main

from reconcile.cli.main import app as reconcile
from servo_ctrl.cli.main import app as servo_ctrl
from tests.campaigns.blind.families.fit import fitted
from tests.campaigns.blind.families.merge import merged
from tests.campaigns.pages import claims, families, tables
from tests.campaigns.pages.generated import GENERATED, ROOT, Generated, between
from tests.campaigns.pages.leave_out import BEGUN, leave_out

LISTED = claims.read(tomllib.loads((ROOT / "docs/claims.toml").read_text(encoding="utf-8")))
PROGRAMS: dict[str, Any] = {"reconcile": reconcile, "servo-ctrl": servo_ctrl}
NO_CLAIMS = {"docs/claims.md"}
"""Pages that claim nothing of their own."""


@pytest.mark.parametrize("one", GENERATED, ids=lambda one: one.page)
def test_a_page_is_that_of_its_sources(one: Generated) -> None:
    assert all((ROOT / source).exists() for source in one.sources)
    document = (ROOT / one.page).read_text(encoding="utf-8")
    assert one.filled(document) == document, "run: make pages"


def test_every_committed_json_of_the_documents_makes_a_table_or_shows_a_claim() -> None:
    used = {source for one in GENERATED for source in one.sources}
    kept = {str(file.relative_to(ROOT)) for file in (ROOT / "docs").glob("*.json")}
    assert kept <= used | {file for one in LISTED for file in one.files}


CONSTANTS = {
    "docs/commands.md": "objects and bytes, held by tests/docs/test_commands_page.py",
    "docs/fault_policy.md": "the policy's own bounds, held by tests/unit/servo_axis/test_fault_bounds.py",
    "docs/local_socket.md": "bytes of the protocol",
    "docs/mqtt.md": "bytes of the stream, held by tests/docs/test_mqtt_document.py",
}
"""Pages with tables of numbers that nobody measured."""


def test_every_table_of_figures_comes_from_a_committed_json() -> None:
    generated = {one.page for one in GENERATED}
    for file in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        page, document = str(file.relative_to(ROOT)), file.read_text(encoding="utf-8")
        is_whole = page in generated and "<!-- " not in document
        if not is_whole and page not in CONSTANTS:
            loose = list(tables.unmarked(document))
            assert not loose, f"{page}: put marks around {loose}, then python -m tests.campaigns.pages.tables"


def test_tables_are_adopted_and_made_again() -> None:
    page = "a\n<!-- table: x -->\n| n | s |\n| --- | --- |\n| a \\| b | 2 s |\n<!-- end -->\nb\n"
    taken = tables.taken_over(page, {}, "today", "make x")
    rows = [["n", "s"], ["a \\| b", "2 s"]]
    assert taken == {"x": {"command": "make x", "made": "today", "rows": rows}}
    assert json.loads(tables.dumped("docs/a.md", taken)) == {"page": "docs/a.md", "tables": taken}
    assert tables.filled(page.replace("2 s", "3 s"), taken) == page
    again = tables.taken_over(page, taken, "tomorrow", "make y")
    assert again == taken
    with pytest.raises(ValueError, match="not the same"):
        tables.filled("no marks", taken)
    assert list(tables.unmarked("| a | b |\n| --- | --- |\n| x | 2.5 um |\n")) == ["| a | b |"]
    assert not list(tables.unmarked(page))


def test_text_goes_between_its_marks_and_nowhere_else() -> None:
    document = "a\n<!-- x -->\nold\n<!-- end -->\nb\n<!-- y -->\nkept\n<!-- end -->\n"
    assert between(document, "x", "new\n") == document.replace("old", "new")
    with pytest.raises(ValueError, match="found 0"):
        between(document, "z", "new\n")


@cache
def functions_of(file: Path) -> set[str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}


def test_every_file_and_test_of_a_claim_is_there() -> None:
    for one in LISTED:
        for named in one.files:
            path, _, test = named.partition("::")
            assert (ROOT / path).is_file(), f"{one.page}: {path}"
            assert not test or test in functions_of(ROOT / path), f"{one.page}: {named}"


def test_every_command_of_a_claim_exists() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for one in LISTED:
        match one.command.split():
            case ["make", target, *_]:
                assert target in targets, one
            case ["python", "-m", module, *_]:
                assert importlib.util.find_spec(module), one
            case [("reconcile" | "servo-ctrl") as program, *words]:
                command: Any = typer.main.get_command(PROGRAMS[program])
                options = [word for word in words if word.startswith("--")]
                while hasattr(command, "get_command"):
                    command = command.get_command(typer.Context(command), words.pop(0))
                assert command is not None, one
                assert {*options} <= {name for known in command.params for name in known.opts}, one
            case other:
                assert other in ([], ["lint-imports"]), one


def test_every_page_has_its_claims() -> None:
    pages = {"README.md", *(f"docs/{file.name}" for file in (ROOT / "docs").glob("*.md"))}
    listed = {one.page for one in LISTED}
    assert pages - NO_CLAIMS == listed, "write what the page claims into docs/claims.toml, then: make pages"


def test_a_claim_without_a_showing_is_refused() -> None:
    with pytest.raises(ValueError, match="write one of test, json, run, words"):
        claims.read({"a.md": [{"claim": "all is well", "how": "surely"}]})
    with pytest.raises(ValueError, match="name a command or a file"):
        claims.read({"a.md": [{"claim": "all is well", "how": "words"}]})


def row_of(family: str, seed: int, *, named: bool, kind: str = "single") -> dict[str, Any]:
    """A case that conceals backlash, and a verdict that names it or cogging."""
    effect = "backlash" if named else "cogging"
    finding = {"axis": "x", "effect": effect, "over": "", "confidence": 0.9, "equivalent": [], "share": 0.9}
    finding |= {"gain": 0.9, "heldout_gain": 0.9, "sensor": "force", "best_rival": 0.0, "parameters": {}}
    parts = {"noise": {"rms": 1.0}, "unexplained": {"rms": 0.0}, effect: {"rms": 5.0}}
    force = {"measured": 100.0, "parts": parts, "left": 1.0, "matters": 1.0, "is_noise": True}
    concealed = {"name": "backlash", "parameters": {}, "also": [], "alike": [], "observable": True}
    truth = {"family": family, "seed": seed, "kind": kind, "clutter": [], "foreign": None}
    evidence = {"verdict": "effects", "findings": [finding], "accounted": {"x": {"force": force}}}
    evidence |= {"fit": {"x": {"force": {"refitted": {"train": 10.0}}}}, "colour": {"x": {"force": 1.0}}}
    base = {"family": family, "seed": seed, "kind": kind, "sha256": ""}
    return base | {"truth": truth | {"effects": [concealed]}, "evidence": evidence}


def test_the_worst_family_is_held_against_the_bar() -> None:
    rows = [row_of("a", seed, named=True) for seed in range(20)]
    rows += [row_of("b", seed, named=seed < 16) for seed in range(20)]
    result = {"scored": False, "engine": "x", "rows": rows}
    text = families.section(result, result)
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    asked = lines["one effect, observable: its name or declared class"]
    assert "| 20 of 20 | 16 of 20 | 0.80 | **missed** |" in asked
    assert "| 0 of 20 | 4 of 20 | 0.20 | **missed** |" in lines["others: a false name"]
    assert "training seeds, which are not proof" in text
    assert "Observable effects not named: backlash 4 of 40." in text


def test_rules_of_a_family_are_fitted_without_it_and_never_on_scored_seeds() -> None:
    ours = [row_of("a", seed, named=True) for seed in range(4)]
    others = [row_of("b", seed, named=False) for seed in range(4)]
    training = {"scored": False, "engine": "x", "rows": [*ours, *others]}
    found = leave_out(training, training)
    assert found.rules["a"] == fitted(others, BEGUN)
    assert found.rules["b"] == fitted(ours, BEGUN)
    with pytest.raises(ValueError, match="training seeds"):
        leave_out(training | {"scored": True}, training | {"scored": True})


def test_runs_are_merged_once_each_and_of_one_sort() -> None:
    row = {"family": "f", "seed": 1, "kind": "single", "error": "none", "truth": {}}
    one, scored = {"scored": False, "rows": [row]}, {"scored": True, "rows": [{**row, "seed": 2}]}
    assert merged([one], "x") == {"scored": False, "engine": "x", "rows": [row]}
    with pytest.raises(ValueError, match="in two of the files"):
        merged([one, one], "x")
    with pytest.raises(ValueError, match="merge them apart"):
        merged([one, scored], "x")
