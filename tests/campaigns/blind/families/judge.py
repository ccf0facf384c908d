"""Conceal foreign physics of a drawn size, and tell what can be observed by running with and without each.

Behind a zero-phase low pass of 40 Hz and while the axis moves, the residual of a run is the recorded force
less the true inertia, viscous and Coulomb friction of the plant without concealed effects, and the motor's
position taken from the scale's. An effect contributes what the residual of the run with all has more than
that of the run without it, sensors ideal in both, as far as the three terms of the nominal model cannot stand
in for it. The noise floor is the RMS of what the sensors' noise adds to the residual of the run with all.

Observable is an effect of which the RMS reaches the floor, or that of its strongest twentieth three floors,
and that holds 2 % of the square of what a fitted nominal model leaves. One that comes back so often a turn is
not where no recording travels two of its periods: what has come once may be any force of the place.
"""

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from tests.campaigns.blind.families.grammar import draw, evaluate
from tests.campaigns.blind.families.interface import Array, Case, Channels, Effect

CORNER_HZ = 40.0
"""Corner of the low pass of the residual, Hz; chosen."""
EDGE_S = 0.2
"""Span at either end that the low pass distorts, seconds; chosen."""
LEAST_RMS, LEAST_PEAK, LEAST_SHARE = 1.0, 3.0, 0.02
"""Bound from below the RMS of an effect and of its strongest part over the noise floor, and its share of
the squares; chosen."""
STRONGEST = 0.05
"""Share of the samples in the strongest part; chosen."""
SMALLEST, LARGEST = 3.0, 30.0
"""Bound the RMS of foreign physics, in noise floors; chosen."""
MOST_OF_FORCE = 0.35
"""Bounds the RMS of foreign physics over that of the motor force; chosen: more would stop the machine."""
LEAST_PERIODS = 2.0
"""Bounds from below the periods of an effect that one recording travels; chosen."""
PASSES = 2
"""Runs in which foreign force and motion become consistent; chosen."""


@dataclass(frozen=True)
class Drawn:
    """A case as it is written: what was recorded, and the truth about it."""

    recordings: list[Channels]
    truth: dict[str, object]


def drawn(case: Case) -> Drawn:
    """Simulate a case with all that it conceals, and measure what each part contributes."""
    rng = np.random.default_rng([case.seed, zlib.crc32(case.family.encode())])
    clean = case.simulate(case.names, False, None)
    noisy = case.simulate(case.names, True, None)
    floor = _rms(np.concatenate([_left(case, a) - _left(case, b) for a, b in zip(noisy, clean, strict=True)]))
    outside: dict[str, object] | None = None
    foreign: list[Array] | None = None
    if case.has_foreign:
        expression = draw(rng, [coordinates(one) for one in clean])
        size = floor * math.exp(rng.uniform(math.log(SMALLEST), math.log(LARGEST)))
        size = min(size, MOST_OF_FORCE * _rms(np.concatenate([one["force"] for one in clean])))
        alone = clean
        for _ in range(PASSES):
            raw = [evaluate(expression, coordinates(one), number) for number, one in enumerate(clean)]
            scale = size / _rms(np.concatenate(raw))
            foreign = [scale * one for one in raw]
            clean = case.simulate(case.names, False, foreign)
        noisy = case.simulate(case.names, True, foreign)
        size_n, peak_n, left_n = _contribution(case, clean, alone, "force")
        enough = (size_n >= LEAST_RMS * floor or peak_n >= LEAST_PEAK * floor) and (
            size_n / left_n
        ) ** 2 >= LEAST_SHARE
        outside = {"expression": expression, "rms": size_n, "floors": size_n / floor, "observable": enough}
    truth = {
        "family": case.family,
        "seed": case.seed,
        "kind": case.kind,
        "rotary": case.rotary,
        "effects": [_judged(case, index, clean, noisy, foreign) for index in range(len(case.effects))],
        "clutter": list(case.clutter),
        "foreign": outside,
        "noise_floor": floor,
        "force_rms": _rms(np.concatenate([_low_pass(one["force"], one) for one in noisy])),
        "sound": vars(case.sound),
        "nominal": vars(case.nominal),
    }
    return Drawn(noisy, truth)


def coordinates(run: Channels) -> Channels:
    """Return the coordinates of the grammar, each divided by its largest size, and `seconds`."""
    x, v, a = _motion(run)
    warm = run.get("temperature", np.zeros_like(x))
    raw = {
        "position": x - 0.5 * (x.max() + x.min()),
        "velocity": v,
        "acceleration": a,
        "force": _low_pass(run["force"], run),
        "time": run["time"],
        "temperature": warm - warm[0],
    }
    return {name: u / max(float(np.abs(u).max()), 1e-9) for name, u in raw.items()} | {"seconds": run["time"]}


def _judged(
    case: Case,
    index: int,
    clean: Sequence[Channels],
    noisy: Sequence[Channels],
    foreign: Sequence[Array] | None,
) -> dict[str, object]:
    effect = case.effects[index]
    without = case.simulate(case.names - {effect.name}, False, foreign)
    rms, peak, left, floor, why = 0.0, 0.0, 1.0, 0.0, ""
    if effect.side == "deviation" and "scale" not in clean[0]:
        why = "no scale"
    else:
        rms, peak, left = _contribution(case, clean, without, effect.side)
        pairs = zip(noisy, clean, strict=True)
        floor = _rms(
            np.concatenate([_side(case, a, effect.side) - _side(case, b, effect.side) for a, b in pairs])
        )
    share = (rms / left) ** 2
    if not why and _periods(case, effect, clean) < LEAST_PERIODS:
        why = "fewer than two of its periods are travelled"
    elif not why and rms < LEAST_RMS * floor and peak < LEAST_PEAK * floor:
        why = "smaller than the noise"
    elif not why and share < LEAST_SHARE:
        why = "a small share of what is unexplained"
    found = {
        "observable": not why,
        "why_not": why,
        "rms": rms,
        "strongest": peak,
        "floor": floor,
        "share": share,
    }
    return vars(effect) | found


def _periods(case: Case, effect: Effect, runs: Sequence[Channels]) -> float:
    """Return how often an effect comes back within the longest travel; infinite if not by the place."""
    if "harmonic" not in effect.parameters:
        return math.inf
    turn = 2.0 * math.pi / case.sound.gear_ratio if case.rotary else case.sound.lead_m
    longest = max(float(np.ptp(one["motor"])) for one in runs)
    return effect.parameters["harmonic"] * longest / turn


def _contribution(
    case: Case, with_it: Sequence[Channels], without: Sequence[Channels], side: str
) -> tuple[float, float, float]:
    """Return the RMS of what makes the difference, that of its strongest part, and of all that is left."""
    own = np.concatenate(
        [_side(case, a, side) - _side(case, b, side) for a, b in zip(with_it, without, strict=True)]
    )
    every = np.concatenate([_side(case, one, side) for one in with_it])
    if side == "force":
        base = np.concatenate([_nominal_terms(one) for one in with_it])
        own, every = _rest(own, base), _rest(every, base)
    strongest = np.sort(np.abs(own))[-max(round(STRONGEST * len(own)), 1) :]
    return _rms(own), _rms(strongest), max(_rms(every), 1e-15)


def _side(case: Case, run: Channels, side: str) -> Array:
    if side == "force":
        return _left(case, run)
    between = _low_pass(run["scale"] - run["motor"], run)
    use = _used(run)
    return between * use - use * between[use > 0.0].mean()


def _left(case: Case, run: Channels) -> Array:
    a, v, sign = _nominal_terms(run).T
    s = case.sound
    known = s.inertia * a + s.viscous * v + s.coulomb * sign - s.constant_n * _used(run)
    return _low_pass(run["force"], run) * _used(run) - known


def _nominal_terms(run: Channels) -> Array:
    _, v, a = _motion(run)
    sign = _low_pass(np.sign(v) * (np.abs(v) > 0.002 * np.abs(v).max()), run)
    return np.stack((a, v, sign), axis=1) * _used(run)[:, None]


def _used(run: Channels) -> Array:
    """Return 1 while the command moves, 0 at rest and at the edges, where the low pass has no neighbours."""
    edge = round(EDGE_S / _period_s(run))
    speed = np.abs(np.gradient(run["command"]))
    use = (speed > 0.002 * speed.max()).astype(np.float64)
    use[:edge] = use[-edge:] = 0.0
    return use


def _motion(run: Channels) -> tuple[Array, Array, Array]:
    x = _low_pass(run["motor"], run)
    v = np.gradient(x, _period_s(run))
    return x, v, np.gradient(v, _period_s(run))


def _low_pass(values: Array, run: Channels) -> Array:
    filtered: Array = sosfiltfilt(butter(2, CORNER_HZ * 2.0 * _period_s(run), output="sos"), values)
    return filtered


def _period_s(run: Channels) -> float:
    return float(run["time"][1] - run["time"][0])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _rest(y: Array, base: Array) -> Array:
    theta, *_ = np.linalg.lstsq(base, y, rcond=None)
    rest: Array = y - base @ theta
    return rest
