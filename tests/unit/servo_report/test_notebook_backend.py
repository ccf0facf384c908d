"""A program that a notebook starts can draw, and drawing there leaves the notebook's backend alone."""

import importlib
from pathlib import Path

import matplotlib as mpl
import pytest

from servo_ctrl.plots import matplotlib_agg
from servo_ctrl.plots.figures import save
from servo_ctrl.plots.notebook_backend import forget_missing_backend


@pytest.mark.parametrize(
    ("backend", "left"),
    [
        ("module://no_such_package.backend_inline", {}),
        (
            "module://matplotlib.backends.backend_svg",
            {"MPLBACKEND": "module://matplotlib.backends.backend_svg"},
        ),
        ("pdf", {"MPLBACKEND": "pdf"}),
    ],
)
def test_a_backend_that_is_not_installed_is_forgotten(backend: str, left: dict[str, str]) -> None:
    variables = {"MPLBACKEND": backend}
    forget_missing_backend(variables)
    assert variables == left


def test_without_a_backend_nothing_changes() -> None:
    variables = {"PATH": "/bin"}
    forget_missing_backend(variables)
    assert variables == {"PATH": "/bin"}


def test_drawing_leaves_the_backend_of_the_caller(tmp_path: Path) -> None:
    with mpl.rc_context():
        mpl.use("svg")
        figure = importlib.reload(matplotlib_agg).Figure()
        figure.subplots().plot([0.0, 1.0])
        save(figure, tmp_path / "line.png")
        assert mpl.get_backend() == "svg"
    assert (tmp_path / "line.png").read_bytes().startswith(b"\x89PNG")
