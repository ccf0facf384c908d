"""PySINDy, the peer of `reconcile diagnose`: sparse regression with an expert's library.

For each sense the optimisers of PySINDy (STLSQ over thresholds and ridges, alone and as the median of an
ensemble over resampled blocks; SR3; FROLS) propose supports on half of every recording. The next quarter
chooses among them. The chosen terms, refitted on three quarters, are named by their effects and ranked by
the variance that the model loses without them. The last quarter is what `reconcile` holds out too.
`RULES` were set on the training seeds of the blind trials (below 10000), none of which is scored.
"""

import warnings
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pysindy
from numpy.typing import NDArray

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.catalogue.registry import ENTRIES
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.recording import AxisRecording
from reconcile.regression.model_presliding import regressed_terms
from reconcile.regression.regression_data import regression_data
from tests.campaigns.bench.sindy_library import Library, Term, rows

Index = NDArray[np.int64]

SMALL = 1e-9
TIMING = ("current_loop_lag", "transport_delay")
"""Below one sample they are how the channels were sampled, for the expert as for `reconcile`."""


class Rules(NamedTuple):
    """What is tried, and what no data of a case can tell."""

    ridges: tuple[float, ...] = (1e-4, 1e-3, 1e-2, 1e-1)
    """Of columns of unit length."""
    thresholds: tuple[float, ...] = (0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.45)
    """Of the length of what the base leaves."""
    ensemble: int = 11
    """Resamplings, each with every second threshold."""
    ensemble_ridge: float = 1e-2
    most_terms: int = 12
    complexity: float = 0.005
    """Each term must lower the sum of squares of the choosing quarter by this share."""
    least_share: float = 0.1
    """Of the variance; below it an effect is fitted but not named."""


RULES = Rules()


class Held(NamedTuple):
    """RMS on the quarter held out, SI: what every model has, refitted; and with the terms chosen."""

    refitted: float
    after: float


class Peer(NamedTuple):
    """What PySINDy says of one axis."""

    named: list[tuple[str, float]]
    """Effects and the share of the variance that is lost without each, strongest first."""
    held_out: dict[str, Held]
    chosen_by: dict[str, str]
    """The optimiser whose support the choosing quarter preferred."""


class Proposals(NamedTuple):
    """One sense of an axis: the models that the optimisers propose, judged by the quarter that chooses."""

    channel: ResidualChannel
    period_s: float
    library: Library
    models: list[tuple[str, list[Term], float]]
    """Optimiser, terms, and the sum of squares left over that of the base alone."""


def diagnose(recordings: Sequence[AxisRecording], axis: NominalAxis, rules: Rules = RULES) -> Peer:
    """Both senses of an axis."""
    return chosen(proposals(recordings, axis, rules), rules)


def proposals(recordings: Sequence[AxisRecording], axis: NominalAxis, rules: Rules) -> list[Proposals]:
    """What can be chosen from, in each sense that was recorded."""
    found = []
    for channel in ResidualChannel:
        own = [r for r in recordings if channel is ResidualChannel.FORCE or r.scale_m is not None]
        if own:
            datasets = [regression_data(recording, axis) for recording in own]
            library = Library(datasets, channel, regressed_terms(axis, datasets, channel))
            found.append(Proposals(channel, own[0].period_s, library, _models(library, rules)))
    return found


def chosen(found: Sequence[Proposals], rules: Rules) -> Peer:
    """The best model of each sense, its terms paid for, and what it names."""
    named: dict[str, float] = {}
    held_out, chosen_by = {}, {}
    for channel, period_s, library, models in found:
        by, best, _ = min(models, key=lambda model: model[2] + rules.complexity * len(model[1]))
        fit, choose, held = library.quarters()
        p_seen, p_held = library.products(np.concatenate((fit, choose))), library.products(held)
        theta = _solved(p_seen, best, library)
        refitted = _left(p_held, [], _solved(p_seen, [], library), library)
        after = _left(p_held, best, theta, library)
        held_out[channel.value] = Held(library.rms(refitted, held), library.rms(after, held))
        chosen_by[channel.value] = by
        for effect, share in _shares(library, best, theta, p_seen, period_s).items():
            if share >= rules.least_share:
                named[effect] = max(share, named.get(effect, 0.0))
    return Peer(sorted(named.items(), key=lambda pair: -pair[1]), held_out, chosen_by)


def _models(library: Library, rules: Rules) -> list[tuple[str, list[Term], float]]:
    """Each support once, its hypotheses made whole (sine with cosine), fitted by least squares."""
    fit, choose, _ = library.quarters()
    p_fit, p_choose = library.products(fit), library.products(choose)
    nothing = _left(p_choose, [], _solved(p_fit, [], library), library)
    models: dict[tuple[int, ...], tuple[str, list[Term], float]] = {(): ("none", [], 1.0)}
    for name, support in _supports(library, fit, p_fit, rules):
        key = tuple(i for i, term in enumerate(library.terms) if any(slot in support for slot in term.slots))
        if key not in models and len(key) <= rules.most_terms:
            terms = [library.terms[i] for i in key]
            left = _left(p_choose, terms, _solved(p_fit, terms, library), library)
            models[key] = name, terms, left / nothing
    return list(models.values())


def _shares(
    library: Library, best: list[Term], theta: Array, products: Array, period_s: float
) -> dict[str, float]:
    """By effect, the share of the variance that is lost without it."""
    whole = _left(products, [], _solved(products, [], library), library)
    left = _left(products, best, theta, library)
    shares = {}
    for effect in dict.fromkeys(term.effect for term in best):
        own = [term for term in best if term.effect == effect]
        others = [term for term in best if term.effect != effect]
        share = (_left(products, others, _solved(products, others, library), library) - left) / whole
        if effect in TIMING:
            place = library.coefficient(own[0], theta)
            time_s = ENTRIES[effect].parameters(own[0].shape, np.array([place]))["time_s"].value
            if abs(time_s) < period_s:
                continue
        shares[effect] = share
    return shares


def _supports(library: Library, fit: Index, products: Array, rules: Rules) -> Iterator[tuple[str, set[int]]]:
    """Optimiser and the slots that it keeps."""
    x, y, usable = rows(products, library.base)
    slots = np.flatnonzero(usable) + library.base
    x = x[:, usable]

    def kept(coefficients: Array) -> set[int]:
        return set(slots[np.abs(coefficients) > SMALL].tolist())

    for ridge in rules.ridges:
        for threshold in rules.thresholds:
            yield f"STLSQ({threshold}, {ridge})", kept(_fitted(_stlsq(x, threshold, ridge), x, y))
    for threshold in rules.thresholds:
        sr3 = pysindy.SR3(reg_weight_lam=0.5 * threshold**2, relax_coeff_nu=1.0, max_iter=100, tol=1e-6)
        yield f"SR3({threshold})", kept(_fitted(sr3, x, y))
    frols = pysindy.FROLS(max_iter=min(rules.most_terms, x.shape[1] - 1), alpha=1e-6)
    _fitted(frols, x, y)
    for count, path in enumerate(frols.history_):
        yield f"FROLS({count})", kept(path[0])
    rng = np.random.default_rng(0)
    drawn = [_resampled(library, rng.choice(fit, len(fit)), slots) for _ in range(rules.ensemble)]
    for threshold in rules.thresholds[1::2] if rules.ensemble else ():
        found = [_fitted(_stlsq(x, threshold, rules.ensemble_ridge), *one) for one in drawn]
        yield f"ensemble of STLSQ({threshold})", kept(np.median(found, axis=0))


def _resampled(library: Library, blocks: Index, slots: Index) -> tuple[Array, Array]:
    x, y, _ = rows(library.products(blocks), library.base)
    return x[:, slots - library.base], y


def _stlsq(x: Array, threshold: float, ridge: float) -> pysindy.STLSQ:
    guess = np.zeros((1, x.shape[1]))  # else a plain least squares is made first, and not used
    return pysindy.STLSQ(threshold, ridge, ridge_kw={"solver": "cholesky"}, initial_guess=guess, unbias=False)


def _fitted(optimizer: pysindy.BaseOptimizer, x: Array, y: Array) -> Array:
    """Coefficients (columns,); none where nothing passes the threshold."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        coefficients: Array = optimizer.fit(x, y).coef_[0]
    return coefficients


def _places(terms: Sequence[Term], library: Library) -> list[int]:
    return [*range(library.base), *(slot for term in terms for slot in term.slots)]


def _solved(products: Array, terms: Sequence[Term], library: Library) -> Array:
    """Least squares on the base and these terms; (slots,), 0 for all the others."""
    places = np.array(_places(terms, library))
    a = products[np.ix_(places + 1, places + 1)]
    a = a + SMALL * np.eye(len(a)) * max(products[0, 0], 1e-300)
    theta = np.zeros(len(products) - 1)
    theta[places] = np.linalg.solve(a, products[places + 1, 0])
    return theta


def _left(products: Array, terms: Sequence[Term], theta: Array, library: Library) -> float:
    """Sum of squares that these terms leave."""
    places = np.array([-1, *_places(terms, library)]) + 1
    weights = np.concatenate(([1.0], -theta[places[1:] - 1]))
    return float(weights @ products[np.ix_(places, places)] @ weights)
