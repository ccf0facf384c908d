"""A class name occurs once a package: so a reader knows which class is meant."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = sorted(path.parent.name for path in ROOT.glob("[a-z]*/__init__.py") if path.parent.name != "tests")
OF_ONE_EFFECT = {"Params", "State"}
"""Each effect and each compensation has its own, in a file that is named after it."""


@pytest.mark.parametrize("package", PACKAGES)
def test_a_class_name_occurs_once_a_package(package: str) -> None:
    files = defaultdict(list)
    for path in sorted((ROOT / package).rglob("*.py")):
        for statement in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(statement, ast.ClassDef) and statement.name not in OF_ONE_EFFECT:
                files[statement.name].append(path.relative_to(ROOT).as_posix())
    assert {name: where for name, where in files.items() if len(where) > 1} == {}


def test_all_packages_are_looked_at() -> None:
    assert {"servo_ctrl", "hil_sim", "reconcile", "studies", "twin", "kernels", "local_can"} <= set(PACKAGES)
