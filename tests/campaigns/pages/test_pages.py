"""Generated text equals the committed text, and every claim names what is there."""

import ast
import importlib.util
import re
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import typer.main

from reconcile.cli.main import app as reconcile
from servo_ctrl.cli.main import app as servo_ctrl
from tests.campaigns.blind.families.merge import merged
from tests.campaigns.pages import claims, families
from tests.campaigns.pages.generated import GENERATED, ROOT, Generated, between

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


def test_the_worst_family_is_held_against_the_bar() -> None:
    def shares(right: float, false: float) -> dict[str, dict[str, float | int | None]]:
        figures: dict[str, dict[str, float | int | None]] = {
            name: {"share": None, "of": 0} for name in families.BARS
        }
        figures["failed"] = {"share": 0.0, "of": 20}
        figures["right_of_single"] = {"share": right, "of": 10}
        return figures | {"false_names_beside_true": {"share": false, "of": 10}}

    summary = {"a": shares(0.9, 0.0), "b": shares(0.8, 0.1)}
    text = families.section({"scored": False, "engine": "x", "summary": summary})
    lines = {line.split(" | ")[0].strip("| "): line for line in text.splitlines()}
    assert lines["one effect, observable: its name or declared class"].endswith(
        "| 9 of 10 | 8 of 10 | 0.80 | **missed** |"
    )
    assert lines["others: a false name"].endswith("| 0 of 10 | 1 of 10 | 0.10 | **missed** |")
    assert lines["diagnosis failed"].endswith("| 0 of 20 | 0 of 20 | 0.00 |  |")
    assert "training seeds, which are no proof" in text


def test_runs_are_merged_once_each_and_of_one_sort() -> None:
    row = {"family": "f", "seed": 1, "kind": "single", "error": "none", "truth": {}}
    one, scored = {"scored": False, "rows": [row]}, {"scored": True, "rows": [{**row, "seed": 2}]}
    assert "truth" not in merged([one], "x")["rows"][0]
    with pytest.raises(ValueError, match="in two of the files"):
        merged([one, one], "x")
    with pytest.raises(ValueError, match="merge them apart"):
        merged([one, scored], "x")
