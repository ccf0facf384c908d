"""Every notebook compiles and runs an example that there is; `make notebooks` executes them."""

from pathlib import Path

import pytest

from reconcile.cli.example import DataSet
from tests.campaigns.notebooks.main import NOTEBOOKS, code_of


def test_there_are_three_axes() -> None:
    assert {one.stem for one in NOTEBOOKS} == {"emps", "odrive", "fditools"}


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda one: one.stem)
def test_a_notebook_compiles_and_runs_its_example(notebook: Path) -> None:
    code = code_of(notebook)
    compile(code, notebook.name, "exec")
    assert f'"example", "{notebook.stem}"' in code
    assert DataSet(notebook.stem)
