"""A program started from a notebook of another environment can still draw."""

import pytest

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
