"""`reconcile diagnose` in `make bench-real`: the force of the model file that it writes, loaded again.

Nothing is fitted to the recording that is judged: what is left is `before` of a second diagnosis.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.nominal_model.model_file import load_model
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem
from tests.campaigns.bench.real_data import Judged


class Said(NamedTuple):
    """What the tool says of some recordings."""

    verdict: str
    findings: list[dict[str, Any]]
    model: Path | None
    seconds: float
    failure: str = ""

    def names(self, axis: str) -> list[str]:
        """Effects of an axis with their confidence, as text."""
        own = [one for one in self.findings if one.get("axis") == axis]
        return [f"{one['effect']} {100.0 * one['confidence']:.0f} %" for one in own]


def ask(paths: Sequence[Path], nominal: Path, out: Path) -> Said:
    """Diagnose; a refusal is an answer too."""
    started_s = time.perf_counter()
    try:
        found = diagnose(paths, nominal, out, with_report=False, with_next=False)
    except ReconcileError as refused:
        return Said("refused", [], None, time.perf_counter() - started_s, str(refused))
    except Exception as error:  # noqa: BLE001  # the other recordings are wanted all the same
        failure = f"{type(error).__name__}: {error}"
        return Said("failed", [], None, time.perf_counter() - started_s, failure)
    seconds = time.perf_counter() - started_s
    return Said(found.verdict["verdict"], found.verdict["findings"], found.model_file, seconds)


def error_of(model: Path, one: Judged) -> float:
    """RMS of what the written model leaves of a recording, N. Raises ReconcileError: it cannot be loaded."""
    return float(np.sqrt(np.mean(_left_n(load_model(model).axes[one.recording.axis], one)[one.used] ** 2)))


def _left_n(axis: NominalAxis, one: Judged) -> Array:
    data = regression_data(one.recording, axis)
    terms = regressed_terms(axis, [data], ResidualChannel.FORCE)
    problem = regression_problem([data], ResidualChannel.FORCE, only=True, model_terms=terms)
    target, columns = problem.target_and_columns(0)
    base = baseline_parameters(axis)
    left: Array = target - columns @ np.array([base[name] for name in problem.baseline_names])
    return left
