"""Every notebook compiles and runs an example that there is; `make notebooks` executes them."""

import json
from pathlib import Path

import pytest

from reconcile.cli.example import DataSet
from tests.campaigns.notebooks.main import NOTEBOOKS, code_of, printed_by


def test_there_are_three_axes() -> None:
    assert {one.stem for one in NOTEBOOKS} == {"emps", "odrive", "fditools"}


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda one: one.stem)
def test_a_notebook_compiles_and_runs_its_example(notebook: Path) -> None:
    code = code_of(notebook)
    compile(code, notebook.name, "exec")
    assert f'"example", "{notebook.stem}"' in code
    assert DataSet(notebook.stem)


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda one: one.stem)
def test_a_notebook_has_been_executed_and_stays_small(notebook: Path) -> None:
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    assert all(cell["execution_count"] and cell["outputs"] for cell in cells if cell["cell_type"] == "code")
    assert "axis" in printed_by(notebook)
    assert "\x1b" not in printed_by(notebook)
    assert notebook.stat().st_size < 20_000
