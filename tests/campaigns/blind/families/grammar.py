"""Foreign physics from a grammar: random products of coordinates with memory, delay, place and time.

    force   := term | term + term
    term    := factor [* factor] [* place] [* time]
    factor  := shape(source)
    source  := coordinate | lag(source) | delay(source) | play(source)
    shape   := odd power | tanh | bump | wave
    place   := window | half line | teeth, of position
    time    := step | ramp | burst | pulses, in one recording or in all; a term without it is always there

An expression is nested lists, as it stands in the sealed truth. Coordinates are divided by their largest
size first, so a number in it has no unit. Each term has two coordinates or a memory, and a draw that a sum of
functions of one coordinate imitates is drawn anew: a catalogue names those.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.signal import lfilter

from tests.campaigns.blind.families.interface import Array, Channels

Expression = list[Any]
COORDINATES = ("position", "velocity", "acceleration", "force", "time", "temperature")
LEAST_APART = 0.6
"""Bounds from below the share of the RMS that functions of one coordinate leave unexplained; chosen."""
ATTEMPTS = 200
"""Bounds the draws of an expression that is apart; chosen."""


def draw(rng: np.random.Generator, runs: Sequence[Channels]) -> Expression:
    """Draw an expression that is apart from all functions of one coordinate on these `runs`.

    Raises:
        RuntimeError: no draw is apart.
    """
    for _ in range(ATTEMPTS):
        terms = [_term(rng, runs) for _ in range(1 + int(rng.random() < 0.35))]
        expression = ["sum", *terms]
        if not all(map(_is_foreign, terms)):
            continue
        values = [evaluate(expression, one, number) for number, one in enumerate(runs)]
        if _rms(np.concatenate(values)) > 1e-3 and _apart(values, runs) > LEAST_APART:
            return expression
    raise RuntimeError(f"{ATTEMPTS} expressions were all like functions of one coordinate: give more motion")


def evaluate(expression: Expression, run: Channels, number: int) -> Array:
    """Return the expression (n,) in recording `number`, from 0; `run` holds COORDINATES, each (n,)."""
    head, *rest = expression
    if head in COORDINATES:
        source: Array = run[head]
        return source
    if head == "sum":
        return np.asarray(np.sum([evaluate(one, run, number) for one in rest], axis=0))
    if head == "product":
        return np.asarray(np.prod([evaluate(one, run, number) for one in rest], axis=0))
    if head in TIMES:
        only, *values = rest
        alone = 1.0 if only in (-1, number) else 0.0
        return alone * TIMES[head](run["seconds"], *values)
    *values, inner = rest
    return WITH_MEMORY[head](evaluate(inner, run, number), run["seconds"], *values)


def _is_foreign(term: Expression) -> bool:
    heads = set(_heads(term))
    coordinates = {*COORDINATES} & heads | ({"time"} if {*TIMES} & heads else set())
    return len(coordinates) > 1 or (bool({"lag", "play"} & heads) and coordinates != {"time"})


def _heads(expression: Expression) -> list[str]:
    return [str(expression[0]), *(h for one in expression if isinstance(one, list) for h in _heads(one))]


def _term(rng: np.random.Generator, runs: Sequence[Channels]) -> Expression:
    term: Expression = ["product", *(_factor(rng, runs) for _ in range(1 + int(rng.random() < 0.7)))]
    if rng.random() < 0.5:
        term.append(_place(rng))
    if rng.random() < 0.6:
        term.append(_time(rng, runs))
    return term


def _factor(rng: np.random.Generator, runs: Sequence[Channels]) -> Expression:
    source = _source(rng, runs)
    shape = str(rng.choice(["power", "tanh", "bump", "wave"]))
    values = {
        "power": [rng.uniform(0.4, 3.0)],
        "tanh": [rng.uniform(1.5, 20.0)],
        "bump": [rng.uniform(-0.7, 0.7), rng.uniform(0.1, 0.5)],
        "wave": [math.exp(rng.uniform(0.0, math.log(40.0))), rng.uniform(0.0, 2.0 * math.pi)],
    }[shape]
    return [shape, *(float(value) for value in values), source]


def _source(rng: np.random.Generator, runs: Sequence[Channels]) -> Expression:
    moving = [name for name in COORDINATES if any(np.ptp(one[name]) > 1e-6 for one in runs)]
    source: Expression = [str(rng.choice(moving))]
    for _ in range(int(rng.choice([0, 1, 2], p=[0.45, 0.4, 0.15]))):
        kind = str(rng.choice(["lag", "delay", "play"]))
        value = {
            "lag": math.exp(rng.uniform(math.log(0.03), math.log(4.0))),
            "delay": math.exp(rng.uniform(math.log(0.01), math.log(0.5))),
            "play": rng.uniform(0.05, 0.6),
        }[kind]
        source = [kind, float(value), source]
    return source


def _place(rng: np.random.Generator) -> Expression:
    kind = str(rng.choice(["window", "half_line", "teeth"]))
    values = {
        "window": [rng.uniform(-0.7, 0.7), rng.uniform(0.1, 0.5)],
        "half_line": [rng.uniform(-0.5, 0.5), rng.choice([-1.0, 1.0])],
        "teeth": [math.exp(rng.uniform(0.0, math.log(30.0))), rng.uniform(0.15, 0.6)],
    }[kind]
    return [kind, *(float(value) for value in values), ["position"]]


def _time(rng: np.random.Generator, runs: Sequence[Channels]) -> Expression:
    last_s = min(float(one["seconds"][-1]) for one in runs)
    only = int(rng.integers(len(runs))) if rng.random() < 0.5 else -1
    kind = str(rng.choice(list(TIMES)))
    begin_s = rng.uniform(0.1, 0.7) * last_s
    values = {
        "step": [begin_s],
        "ramp": [begin_s, rng.uniform(0.2, 0.6) * last_s],
        "burst": [begin_s, rng.uniform(0.1, 0.4) * last_s],
        "pulses": [rng.uniform(0.4, 5.0), rng.uniform(0.15, 0.5)],
    }[kind]
    return [kind, only, *(float(value) for value in values)]


def _apart(values: Sequence[Array], runs: Sequence[Channels]) -> float:
    columns = []
    for one in runs:
        x, v, a, force = (one[name] for name in ("position", "velocity", "acceleration", "force"))
        sign = np.tanh(v / 0.01)
        plain = [np.ones_like(x), x, x**2, x**3, v, v * np.abs(v), sign, a, force**3, sign * x, sign * x**2]
        plain += [sign * np.exp(-np.abs(v) / width) for width in (0.02, 0.1)]
        columns.append(np.stack([*plain, sign * one["temperature"], v * one["temperature"]], axis=1))
    base, y = np.concatenate(columns), np.concatenate(values)
    theta, *_ = np.linalg.lstsq(base, y, rcond=None)
    return _rms(y - base @ theta) / max(_rms(y), 1e-12)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _lag(values: Array, seconds: Array, time_s: float) -> Array:
    keep = math.exp(-float(seconds[1] - seconds[0]) / time_s)
    out, _ = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])
    return np.asarray(out)


def _play(values: Array, _seconds: Array, width: float) -> Array:
    out, held, half = np.empty_like(values), float(values[0]), 0.5 * width
    for index, value in enumerate(values.tolist()):
        held = min(max(held, value - half), value + half)
        out[index] = held
    return out


WITH_MEMORY: dict[str, Callable[..., Array]] = {
    "lag": _lag,
    "delay": lambda u, s, time_s: np.interp(s - time_s, s, u),
    "play": _play,
    "power": lambda u, _s, power: np.sign(u) * np.abs(u) ** power,
    "tanh": lambda u, _s, steep: np.tanh(steep * u),
    "bump": lambda u, _s, at, width: np.exp(-(((u - at) / width) ** 2)),
    "wave": lambda u, _s, turns, phase: np.sin(math.pi * turns * u + phase),
    "window": lambda u, _s, at, half: (
        0.5 * np.tanh((u - at + half) / 0.02) - 0.5 * np.tanh((u - at - half) / 0.02)
    ),
    "half_line": lambda u, _s, at, side: 0.5 + 0.5 * np.tanh(side * (u - at) / 0.03),
    "teeth": lambda u, _s, turns, share: ((0.5 * turns * u) % 1.0 < share).astype(np.float64),
}
"""Of values (n,), times (n,) in s, and the numbers of the expression."""
TIMES: dict[str, Callable[..., Array]] = {
    "step": lambda s, begin: (s >= begin).astype(np.float64),
    "ramp": lambda s, begin, length: np.clip((s - begin) / length, 0.0, 1.0),
    "burst": lambda s, begin, length: np.exp(-(((s - begin) / (0.5 * length)) ** 4)),
    "pulses": lambda s, period, share: ((s / period) % 1.0 < share).astype(np.float64),
}
"""Of times (n,) in s, and the numbers of the expression."""
