"""The motions that an axis could be asked for, as steps of a program, each within its limits.

Each is a round of steps that is repeated until there is enough of it to be judged.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from servo_ctrl.motion.dwell import Dwell
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.program import segments
from servo_ctrl.motion.sine import Sine
from servo_ctrl.motion.violation import first_violation

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from reconcile.next_experiment_limits import Limits

    Array = NDArray[np.float64]
    Step = Move | Sine | Dwell

RECORD_S, LONGEST_S = 18.0, 90.0
"""A round is repeated for so long; a motion that takes longer is not asked for."""
CREEPS_M_S = (2e-5, 5e-5, 2e-4, 1e-3, 5e-3)
STROKES_M = (4e-6, 1e-5, 3e-5, 1e-4, 4e-4, 2e-3)
DWELLS_S = (0.1, 0.3, 1.0, 3.0)
PLACES = (0.1, 0.5, 0.9)
"""Shares of the travel."""
SHORT_M = 2e-3
"""A start, a slow way."""
SAFE = 0.8
"""Of speed, acceleration and jerk: a sine's beginning needs more than the sine."""
ROUNDED = 1.05
"""A limit that samples may seem to pass, by differences of what was planned within it."""
DIGITS = 9
"""Of metres and seconds in a program: finer says nothing."""


class Motion(NamedTuple):
    """One that may be asked for."""

    kind: str
    words: str
    """What it is, with its numbers."""
    steps: tuple[Step, ...]
    """Of the one axis, from its home to its home."""


class Planned(NamedTuple):
    """What servo_ctrl would command."""

    motion: Motion
    position_m: Array
    """(n,), a sample a period."""
    seconds: float


class _Bounds(NamedTuple):
    """What the motions are drawn from."""

    limits: Limits
    slowest_m_s: float
    finest_m: float


def pool(limits: Limits, period_s: float, slowest_m_s: float, finest_m: float) -> list[Planned]:
    """Every motion within the limits, planned as servo_ctrl does and refused where it would refuse.

    `slowest_m_s`, `finest_m`: a slower speed or a smaller stroke would be noise.
    """
    if limits.velocity_m_s <= slowest_m_s or limits.travel_m <= finest_m:
        return []  # all that it may do is noise
    bounds = _Bounds(limits, slowest_m_s, finest_m)
    found = []
    for kind, words, one_round in _rounds(bounds):
        planned = _filled(Motion(kind, words, one_round), limits, period_s)
        if planned is not None:
            found.append(planned)
    return found


def plan(motion: Motion, limits: Limits, period_s: float) -> Planned | None:
    """The motion's samples from the axis' home; None where it leaves a limit."""
    start, allowed = np.array([limits.home_m]), limits.for_planning()
    parts = list(segments(motion.steps, start, allowed, period_s))
    bound = allowed._replace(
        velocity_m_s=ROUNDED * allowed.velocity_m_s,
        acceleration_m_s2=ROUNDED * allowed.acceleration_m_s2,
        jerk_m_s3=ROUNDED * allowed.jerk_m_s3,
    )
    if not parts or first_violation(iter(parts), start, bound, period_s) is not None:
        return None
    position_m = np.concatenate([start, *(part.position_m[:, 0] for part in parts)])
    return Planned(motion, position_m, len(position_m) * period_s)


def _filled(motion: Motion, limits: Limits, period_s: float) -> Planned | None:
    """Rounds of it, between a way there and a way home."""
    there = motion.steps[0]
    assert isinstance(there, Move)  # noqa: S101  # every round begins at a place
    once = plan(motion, limits, period_s)
    if once is None or once.seconds > LONGEST_S:
        return None
    times = max(round(RECORD_S / once.seconds), 1)
    home = there._replace(label="home", to_m=(round(limits.home_m, DIGITS),))
    return plan(motion._replace(steps=(*motion.steps * times, home)), limits, period_s)


def _rounds(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
    """Kind, words and one round."""
    yield from _creeps(b)
    yield from _small(b)
    yield from _dwells(b)
    yield from _fast(b)
    yield from _waves(b)
    yield from _mixed(b)


def _creeps(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
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


def _small(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
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


def _dwells(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
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


def _fast(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
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


def _waves(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
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


def _mixed(b: _Bounds) -> Iterator[tuple[str, str, tuple[Step, ...]]]:
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


def _to_and_fro(b: _Bounds, way_m: float, speeds_m_s: Iterable[float]) -> tuple[Step, ...]:
    ends = (b.limits.middle_m - 0.5 * way_m, b.limits.middle_m + 0.5 * way_m)
    return (_go(b, ends[0]), *(_go(b, end, speed) for speed in speeds_m_s for end in (ends[1], ends[0])))


def _stairs(b: _Bounds, speeds_m_s: Iterable[float], seconds: float) -> Iterator[Step]:
    """Each speed for so long, there and back, from the middle."""
    yield _go(b, b.limits.middle_m)
    for speed in speeds_m_s:
        way_m = min(seconds * speed, 0.4 * b.limits.travel_m)
        yield _go(b, b.limits.middle_m + way_m, speed)
        yield _go(b, b.limits.middle_m, speed)


def _go(
    b: _Bounds, to_m: float, speed_m_s: float | None = None, acceleration_m_s2: float | None = None
) -> Move:
    speed = b.limits.velocity_m_s if speed_m_s is None else speed_m_s
    hard = b.limits.acceleration_m_s2 if acceleration_m_s2 is None else acceleration_m_s2
    return Move("move", (round(to_m, DIGITS),), round(speed, DIGITS), round(hard, DIGITS), trapezoidal=False)


def _largest(b: _Bounds, hertz: float) -> float:
    """Amplitude of a sine."""
    w, limits = 2.0 * math.pi * hertz, b.limits
    most = (limits.velocity_m_s / w, limits.acceleration_m_s2 / w**2, limits.jerk_m_s3 / w**3)
    return min(SAFE * min(most), 0.45 * limits.travel_m)


def _sine(b: _Bounds, amplitude_m: float, hertz: float, cycles: int) -> Sequence[Step]:
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
