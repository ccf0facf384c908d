"""Rounds of steps that tell something of an axis: slow, small, from rest, fast, in waves, a bit of each."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.motion.dwell import Dwell
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.sine import Sine

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from reconcile.next_experiment_limits import Limits

    Step = Move | Sine | Dwell
    Round = tuple[str, str, tuple[Step, ...]]
    """Kind, words, and the steps from the place where it begins."""

CREEPS_M_S = (2e-5, 5e-5, 2e-4, 1e-3, 5e-3)
STROKES_M = (4e-6, 1e-5, 3e-5, 1e-4, 4e-4, 2e-3)
DWELLS_S = (0.1, 0.3, 1.0, 3.0)
PLACES = (0.1, 0.5, 0.9)
"""Shares of the travel."""
SHORT_M = 2e-3
"""A start, a slow way."""
SAFE = 0.8
"""Of speed, acceleration and jerk: a sine's beginning needs more than the sine."""
DIGITS = 9
"""Of metres and seconds in a program: finer says nothing."""


class Bounds(NamedTuple):
    """What the rounds are drawn from: a slower speed or a smaller stroke would be noise."""

    limits: Limits
    slowest_m_s: float
    finest_m: float


def rounds(b: Bounds) -> Iterator[Round]:
    """All of them; whether servo_ctrl would make them is not asked here."""
    yield from _creeps(b)
    yield from _small(b)
    yield from _dwells(b)
    yield from _fast(b)
    yield from _waves(b)
    yield from _mixed(b)


def _creeps(b: Bounds) -> Iterator[Round]:
    for speed_m_s in _allowed(CREEPS_M_S, b.slowest_m_s, 0.5 * b.limits.velocity_m_s):
        way_m = min(4.0 * speed_m_s, 0.4 * b.limits.travel_m)
        words = f"a creep to and fro at {_mm(speed_m_s)} mm/s over {_mm(way_m)} mm"
        yield "creep", words, _to_and_fro(b, way_m, [speed_m_s])
    slow = _spread(max(b.slowest_m_s, 2e-4), min(0.03, b.limits.velocity_m_s), 7)
    words = f"slow constant speeds from {_mm(slow[0])} to {_mm(slow[-1])} mm/s, each both ways"
    yield "slow speeds", words, tuple(_stairs(b, slow, 0.7))
    wide = _spread(max(0.04 * b.limits.velocity_m_s, b.slowest_m_s), 0.95 * b.limits.velocity_m_s, 6)
    words = f"constant speeds from {_mm(wide[0])} to {_mm(wide[-1])} mm/s over the same places"
    yield "speeds", words, _to_and_fro(b, 0.3 * b.limits.travel_m, wide)


def _small(b: Bounds) -> Iterator[Round]:
    strokes = _allowed(STROKES_M, b.finest_m, 0.4 * b.limits.travel_m)
    for hertz in (1.0, 2.0, 5.0):
        steps = [
            step
            for amplitude_m in strokes
            for step in _sine(b, min(0.5 * amplitude_m, _largest(b, hertz)), hertz, 4)
        ]
        words = f"reversals of growing size, {_um(strokes[0])} to {_um(strokes[-1])} um at {hertz:g} Hz"
        yield "small strokes", words, (_go(b, b.limits.middle_m), *steps)
    at = [b.limits.lowest_m + share * b.limits.travel_m for share in PLACES]
    stroke_m = min(4e-3, 0.1 * b.limits.travel_m)
    inward = [stroke_m if place < b.limits.middle_m else -stroke_m for place in at]
    speed_m_s = max(min(5e-3, b.limits.velocity_m_s), b.slowest_m_s)
    steps = [
        step
        for place, way in zip(at, inward, strict=True)
        for step in (
            _go(b, place),
            *(_go(b, place + end, speed_m_s) for end in (way, 0.0) * 2),
        )
    ]
    words = f"strokes of {_mm(stroke_m)} mm at {_mm(speed_m_s)} mm/s at three places of the travel"
    yield "offsets", words, tuple(steps)


def _dwells(b: Bounds) -> Iterator[Round]:
    middle_m, speed_m_s = b.limits.middle_m, max(min(2e-3, 0.5 * b.limits.velocity_m_s), b.slowest_m_s)
    half_m = 0.5 * min(SHORT_M, 0.2 * b.limits.travel_m)
    steps: list[Step] = [_go(b, middle_m - half_m)]
    for number, seconds in enumerate((*DWELLS_S, *reversed(DWELLS_S))):
        steps += [
            Dwell("rest", seconds),
            _go(b, middle_m + half_m * (1.0 if number % 2 == 0 else -1.0), speed_m_s),
        ]
    rests = ", ".join(f"{one:g}" for one in DWELLS_S)
    yield "dwells", f"slow starts at {_mm(speed_m_s)} mm/s after rests of {rests} s, both ways", tuple(steps)


def _fast(b: Bounds) -> Iterator[Round]:
    limits = b.limits
    for share in (0.3, 0.8):
        half_m = 0.5 * share * limits.travel_m
        words = f"fast strokes over {_mm(2 * half_m)} mm at {_mm(limits.velocity_m_s)} mm/s"
        ends = (limits.middle_m - half_m, limits.middle_m + half_m)
        yield "fast moves", words, tuple(_go(b, end) for end in ends)
    hard = [share * limits.acceleration_m_s2 for share in (0.1, 0.3, 1.0)]
    half_m = 0.2 * limits.travel_m
    steps = [
        _go(b, limits.middle_m + end, acceleration_m_s2=a) for a in hard for end in (-half_m, half_m) * 2
    ]
    words = "strokes over {} mm with accelerations of {} mm/s^2".format(
        _mm(2 * half_m), ", ".join(_mm(a) for a in hard)
    )
    yield "accelerations", words, tuple(steps)
    for share in (0.1, 0.4):
        speed_m_s = max(share * limits.velocity_m_s, b.slowest_m_s)
        words = f"long strokes over {_mm(0.96 * limits.travel_m)} mm at {_mm(speed_m_s)} mm/s"
        half_m = 0.48 * limits.travel_m
        ends = (limits.middle_m - half_m, limits.middle_m + half_m)
        yield "long strokes", words, tuple(_go(b, end, speed_m_s) for end in ends)


def _waves(b: Bounds) -> Iterator[Round]:
    for hertz in (0.15, 0.5):
        amplitude_m = min(_largest(b, hertz), 0.4 * b.limits.travel_m)
        words = f"sines of {_mm(amplitude_m)} mm at {hertz:g} Hz, as a circle would ask for"
        yield "circle", words, (_go(b, b.limits.middle_m), *_sine(b, amplitude_m, hertz, 3))
    hertz_all = (1.0, 2.0, 4.0, 8.0, 16.0)
    steps = [step for hertz in hertz_all for step in _sine(b, 0.7 * _largest(b, hertz), hertz, 6)]
    words = f"sines of rising frequency, {hertz_all[0]:g} to {hertz_all[-1]:g} Hz, as large as they may be"
    yield "chirp", words, (_go(b, b.limits.middle_m), *steps)
    lighter = [step for hertz in hertz_all for step in _sine(b, 0.07 * _largest(b, hertz), hertz, 6)]
    words = f"small sines of rising frequency, {hertz_all[0]:g} to {hertz_all[-1]:g} Hz"
    yield "light chirp", words, (_go(b, b.limits.middle_m), *lighter)


def _mixed(b: Bounds) -> Iterator[Round]:
    """A bit of each: slow, at rest, small and fast."""
    slow = _spread(max(b.slowest_m_s, 5e-4), min(0.02, b.limits.velocity_m_s), 3)
    middle_m, half_m = b.limits.middle_m, 0.4 * b.limits.travel_m
    steps = [
        *_stairs(b, slow, 0.8),
        *_sine(b, min(1e-5, _largest(b, 2.0)), 2.0, 3),
        *_sine(b, min(1e-4, _largest(b, 2.0)), 2.0, 3),
        _go(b, middle_m - half_m),
        Dwell("rest", 0.3),
        _go(b, middle_m + half_m),
        Dwell("rest", 1.5),
        _go(b, middle_m, 0.2 * b.limits.velocity_m_s),
        *_sine(b, 0.5 * _largest(b, 4.0), 4.0, 8),
    ]
    yield (
        "a bit of each",
        "a bit of each: slow speeds, small strokes, rests, fast moves, a sine",
        tuple(steps),
    )


def _to_and_fro(b: Bounds, way_m: float, speeds_m_s: Iterable[float]) -> tuple[Step, ...]:
    ends = (b.limits.middle_m - 0.5 * way_m, b.limits.middle_m + 0.5 * way_m)
    return (_go(b, ends[0]), *(_go(b, end, speed) for speed in speeds_m_s for end in (ends[1], ends[0])))


def _stairs(b: Bounds, speeds_m_s: Iterable[float], seconds: float) -> Iterator[Step]:
    """Each speed for so long, there and back, from the middle."""
    yield _go(b, b.limits.middle_m)
    for speed in speeds_m_s:
        way_m = min(seconds * speed, 0.4 * b.limits.travel_m)
        yield _go(b, b.limits.middle_m + way_m, speed)
        yield _go(b, b.limits.middle_m, speed)


def _go(
    b: Bounds, to_m: float, speed_m_s: float | None = None, acceleration_m_s2: float | None = None
) -> Move:
    speed = b.limits.velocity_m_s if speed_m_s is None else speed_m_s
    hard = b.limits.acceleration_m_s2 if acceleration_m_s2 is None else acceleration_m_s2
    return Move("move", (round(to_m, DIGITS),), round(speed, DIGITS), round(hard, DIGITS), trapezoidal=False)


def _largest(b: Bounds, hertz: float) -> float:
    """Amplitude of a sine."""
    w, limits = 2.0 * math.pi * hertz, b.limits
    most = (limits.velocity_m_s / w, limits.acceleration_m_s2 / w**2, limits.jerk_m_s3 / w**3)
    return min(SAFE * min(most), 0.45 * limits.travel_m)


def _sine(b: Bounds, amplitude_m: float, hertz: float, cycles: int) -> Sequence[Step]:
    if 2.0 * amplitude_m < b.finest_m:
        return ()
    w = 2.0 * math.pi * hertz
    return (Sine("sine", 0, round(amplitude_m, DIGITS), w, float(cycles), round(0.5 / hertz, DIGITS)),)


def _spread(low: float, high: float, count: int) -> list[float]:
    return [float(f"{v:.2g}") for v in np.geomspace(min(low, high), high, count)]


def _allowed(values: Sequence[float], lowest: float, highest: float) -> list[float]:
    """Those within; where none is, the one nearest to it."""
    return [v for v in values if lowest <= v <= highest] or [min(max(values[0], lowest), highest)]


def _mm(value_m: float) -> str:
    return _digits(1e3 * value_m)


def _um(value_m: float) -> str:
    return _digits(1e6 * value_m)


def _digits(value: float) -> str:
    """Three of them, and no power of ten."""
    return f"{float(f'{value:.3g}'):g}"
