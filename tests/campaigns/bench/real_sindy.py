"""PySINDy in `make bench-real`: the terms that it chooses on the others, fitted on them, on the one left out.

What a term would have of each recording (its phase) is shared here: a recording that is left out has none.
"""

from collections.abc import Sequence

import numpy as np

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.examples.real.judged import Judged
from reconcile.examples.real.textbook import Predict
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.regression.regression_problem import regression_problem
from tests.campaigns.bench.sindy_peer import RULES, proposals


def pysindy(train: Sequence[Judged], axis: NominalAxis) -> Predict:
    """The best model of the force, of the axes that every recording has."""
    others = sorted(set.intersection(*(set(one.recording.others) for one in train)))
    recordings = [
        one.recording._replace(scale_m=None, others={name: one.recording.others[name] for name in others})
        for one in train
    ]
    (found,) = proposals(recordings, axis, RULES)
    _, best, _ = min(found.models, key=lambda model: model[2] + RULES.complexity * len(model[1]))
    terms = [(term.effect, term.shape) for term in best]
    x = np.concatenate([_columns(one, terms, others)[one.kept()] for one in train])
    y = np.concatenate([one.force_n[one.kept()] for one in train])
    theta, *_ = np.linalg.lstsq(x, y, rcond=None)
    return lambda one: np.asarray(_columns(one, terms, others) @ theta, dtype=np.float64)


def _columns(one: Judged, terms: Sequence[tuple[str, ShapeParameters]], others: Sequence[str]) -> Array:
    """The terms in this recording (n, terms); ValueError where it lacks one of the `others` axes."""
    if missing := set(others) - set(one.data.others):
        raise ValueError(f"axes {sorted(missing)} were not recorded with {one.recording.axis}")
    data = one.data._replace(others={name: one.data.others[name] for name in others})
    problem = regression_problem([data], ResidualChannel.FORCE, terms, only=True)
    return problem.target_and_columns(0)[1]
