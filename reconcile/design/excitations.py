"""Excitations of an axis as program steps: slow, small, from rest, fast, sinusoidal, and a mix of these."""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from reconcile.design.limits import AxisLimits
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.sine import Sine

Step = Move | Sine | Dwell

CREEP_SPEEDS_M_S = (2e-5, 5e-5, 2e-4, 1e-3, 5e-3)
STROKES_M = (4e-6, 1e-5, 3e-5, 1e-4, 4e-4, 2e-3)
DWELLS_S = (0.1, 0.3, 1.0, 3.0)
TRAVEL_SHARES = (0.1, 0.5, 0.9)
"""Places of repeated small strokes, share of the travel: both ends and the middle."""
SHORT_START_M = 2e-3
"""Travel of a slow start from rest."""
SINE_SHARE = 0.8
"""Share of the limits of speed, acceleration and jerk for a sine, because its ramp needs more."""
DIGITS = 9
"""Decimals of metres and seconds in a program: nanometres."""


class Excitation(NamedTuple):
    """Steps of a program for one axis."""

    kind: str
    words: str
    """A description with its numbers."""
    steps: tuple[Step, ...]
    """The first step moves to the start of the excitation."""


class ExcitationBounds(NamedTuple):
    """Limits of the axis, and the speed and stroke below which a motion is noise."""

    limits: AxisLimits
    min_velocity_m_s: float
    min_stroke_m: float


def excitations(b: ExcitationBounds) -> Iterator[Excitation]:
    """Yield all excitations; some may still violate a limit."""
    for group in (_creeps, _small, _dwells, _fast, _waves, _mixed):
        yield from group(b)


def _creeps(b: ExcitationBounds) -> Iterator[Excitation]:
    for speed_m_s in _within(CREEP_SPEEDS_M_S, b.min_velocity_m_s, 0.5 * b.limits.velocity_m_s):
        distance_m = min(4.0 * speed_m_s, 0.4 * b.limits.travel_m)
        words = f"a creep to and fro at {_mm(speed_m_s)} mm/s over {_mm(distance_m)} mm"
        yield Excitation("creep", words, _to_and_fro(b, distance_m, [speed_m_s]))
    slow = _geometric(max(b.min_velocity_m_s, 2e-4), min(0.03, b.limits.velocity_m_s), 7)
    words = f"slow constant speeds from {_mm(slow[0])} to {_mm(slow[-1])} mm/s, each both ways"
    yield Excitation("slow speeds", words, tuple(_staircase(b, slow, 0.7)))
    wide = _geometric(max(0.04 * b.limits.velocity_m_s, b.min_velocity_m_s), 0.95 * b.limits.velocity_m_s, 6)
    words = f"constant speeds from {_mm(wide[0])} to {_mm(wide[-1])} mm/s over the same places"
    yield Excitation("speeds", words, _to_and_fro(b, 0.3 * b.limits.travel_m, wide))


def _small(b: ExcitationBounds) -> Iterator[Excitation]:
    strokes = _within(STROKES_M, b.min_stroke_m, 0.4 * b.limits.travel_m)
    for frequency_hz in (1.0, 2.0, 5.0):
        largest_m = _max_amplitude(b, frequency_hz)
        sines = [_sine(b, min(0.5 * stroke_m, largest_m), frequency_hz, 4) for stroke_m in strokes]
        span = f"{_um(strokes[0])} to {_um(strokes[-1])} um"
        words = f"reversals of growing size, {span} at {frequency_hz:g} Hz"
        yield Excitation("small strokes", words, (_move(b, b.limits.middle_m), *itertools.chain(*sines)))
    at = [b.limits.min_position_m + share * b.limits.travel_m for share in TRAVEL_SHARES]
    stroke_m = min(4e-3, 0.1 * b.limits.travel_m)
    inward = [stroke_m if place < b.limits.middle_m else -stroke_m for place in at]
    speed_m_s = max(min(5e-3, b.limits.velocity_m_s), b.min_velocity_m_s)
    steps = [
        step
        for place, stroke in zip(at, inward, strict=True)
        for step in (_move(b, place), *(_move(b, place + end, speed_m_s) for end in (stroke, 0.0) * 2))
    ]
    words = f"strokes of {_mm(stroke_m)} mm at {_mm(speed_m_s)} mm/s at three places of the travel"
    yield Excitation("offsets", words, tuple(steps))


def _dwells(b: ExcitationBounds) -> Iterator[Excitation]:
    middle_m, speed_m_s = b.limits.middle_m, max(min(2e-3, 0.5 * b.limits.velocity_m_s), b.min_velocity_m_s)
    half_m = 0.5 * min(SHORT_START_M, 0.2 * b.limits.travel_m)
    steps: list[Step] = [_move(b, middle_m - half_m)]
    for number, seconds in enumerate((*DWELLS_S, *reversed(DWELLS_S))):
        steps += [
            Dwell("rest", seconds),
            _move(b, middle_m + half_m * (1.0 if number % 2 == 0 else -1.0), speed_m_s),
        ]
    rests = ", ".join(f"{one:g}" for one in DWELLS_S)
    words = f"slow starts at {_mm(speed_m_s)} mm/s after rests of {rests} s, both ways"
    yield Excitation("dwells", words, tuple(steps))


def _fast(b: ExcitationBounds) -> Iterator[Excitation]:
    limits = b.limits
    for share in (0.3, 0.8):
        half_m = 0.5 * share * limits.travel_m
        words = f"fast strokes over {_mm(2 * half_m)} mm at {_mm(limits.velocity_m_s)} mm/s"
        yield Excitation("fast moves", words, _stroke(b, half_m))
    hard = [share * limits.acceleration_m_s2 for share in (0.1, 0.3, 1.0)]
    half_m = 0.2 * limits.travel_m
    steps = [
        _move(b, limits.middle_m + end, acceleration_m_s2=a) for a in hard for end in (-half_m, half_m) * 2
    ]
    accelerations = ", ".join(_mm(a) for a in hard)
    words = f"strokes over {_mm(2 * half_m)} mm with accelerations of {accelerations} mm/s^2"
    yield Excitation("accelerations", words, tuple(steps))
    for share in (0.1, 0.4):
        speed_m_s = max(share * limits.velocity_m_s, b.min_velocity_m_s)
        words = f"long strokes over {_mm(0.96 * limits.travel_m)} mm at {_mm(speed_m_s)} mm/s"
        yield Excitation("long strokes", words, _stroke(b, 0.48 * limits.travel_m, speed_m_s))


def _waves(b: ExcitationBounds) -> Iterator[Excitation]:
    for frequency_hz in (0.15, 0.5):
        amplitude_m = min(_max_amplitude(b, frequency_hz), 0.4 * b.limits.travel_m)
        words = f"sines of {_mm(amplitude_m)} mm at {frequency_hz:g} Hz, as a circle would ask for"
        yield Excitation(
            "circle", words, (_move(b, b.limits.middle_m), *_sine(b, amplitude_m, frequency_hz, 3))
        )
    frequencies_hz = (1.0, 2.0, 4.0, 8.0, 16.0)
    span = f"{frequencies_hz[0]:g} to {frequencies_hz[-1]:g} Hz"
    for kind, share, words in (
        ("chirp", 0.7, f"sines of rising frequency, {span}, as large as they may be"),
        ("light chirp", 0.07, f"small sines of rising frequency, {span}"),
    ):
        sines = [_sine(b, share * _max_amplitude(b, f), f, 6) for f in frequencies_hz]
        yield Excitation(kind, words, (_move(b, b.limits.middle_m), *itertools.chain(*sines)))


def _mixed(b: ExcitationBounds) -> Iterator[Excitation]:
    """Yield a mix of slow, resting, small and fast motion."""
    slow = _geometric(max(b.min_velocity_m_s, 5e-4), min(0.02, b.limits.velocity_m_s), 3)
    middle_m, half_m = b.limits.middle_m, 0.4 * b.limits.travel_m
    steps = [
        *_staircase(b, slow, 0.8),
        *_sine(b, min(1e-5, _max_amplitude(b, 2.0)), 2.0, 3),
        *_sine(b, min(1e-4, _max_amplitude(b, 2.0)), 2.0, 3),
        _move(b, middle_m - half_m),
        Dwell("rest", 0.3),
        _move(b, middle_m + half_m),
        Dwell("rest", 1.5),
        _move(b, middle_m, 0.2 * b.limits.velocity_m_s),
        *_sine(b, 0.5 * _max_amplitude(b, 4.0), 4.0, 8),
    ]
    words = "a bit of each: slow speeds, small strokes, rests, fast moves, a sine"
    yield Excitation("a bit of each", words, tuple(steps))


def _stroke(b: ExcitationBounds, half_m: float, speed_m_s: float | None = None) -> tuple[Step, ...]:
    ends = (b.limits.middle_m - half_m, b.limits.middle_m + half_m)
    return tuple(_move(b, end, speed_m_s) for end in ends)


def _to_and_fro(b: ExcitationBounds, distance_m: float, speeds_m_s: Iterable[float]) -> tuple[Step, ...]:
    ends = (b.limits.middle_m - 0.5 * distance_m, b.limits.middle_m + 0.5 * distance_m)
    return (_move(b, ends[0]), *(_move(b, end, speed) for speed in speeds_m_s for end in (ends[1], ends[0])))


def _staircase(b: ExcitationBounds, speeds_m_s: Iterable[float], seconds: float) -> Iterator[Step]:
    """Yield moves from the middle and back at each speed, for `seconds` each way."""
    yield _move(b, b.limits.middle_m)
    for speed in speeds_m_s:
        distance_m = min(seconds * speed, 0.4 * b.limits.travel_m)
        yield _move(b, b.limits.middle_m + distance_m, speed)
        yield _move(b, b.limits.middle_m, speed)


def _move(
    b: ExcitationBounds, to_m: float, speed_m_s: float | None = None, acceleration_m_s2: float | None = None
) -> Move:
    speed = b.limits.velocity_m_s if speed_m_s is None else speed_m_s
    hard = b.limits.acceleration_m_s2 if acceleration_m_s2 is None else acceleration_m_s2
    return Move("move", (round(to_m, DIGITS),), round(speed, DIGITS), round(hard, DIGITS), trapezoidal=False)


def _max_amplitude(b: ExcitationBounds, frequency_hz: float) -> float:
    """Return the largest amplitude of a sine within the limits."""
    w, limits = 2.0 * math.pi * frequency_hz, b.limits
    most = (limits.velocity_m_s / w, limits.acceleration_m_s2 / w**2, limits.jerk_m_s3 / w**3)
    return min(SINE_SHARE * min(most), 0.45 * limits.travel_m)


def _sine(b: ExcitationBounds, amplitude_m: float, frequency_hz: float, cycles: int) -> Sequence[Step]:
    if 2.0 * amplitude_m < b.min_stroke_m:
        return ()
    w = 2.0 * math.pi * frequency_hz
    ramp_s = round(0.5 / frequency_hz, DIGITS)
    return (
        Sine(
            label="sine",
            axis=0,
            amplitude_m=round(amplitude_m, DIGITS),
            speed_rad_s=w,
            cycles=float(cycles),
            ramp_s=ramp_s,
        ),
    )


def _geometric(low: float, high: float, count: int) -> list[float]:
    return [float(f"{v:.2g}") for v in np.geomspace(min(low, high), high, count)]


def _within(values: Sequence[float], lowest: float, highest: float) -> list[float]:
    """Return the values within bounds, or the bound nearest to the first one if there is none."""
    return [v for v in values if lowest <= v <= highest] or [min(max(values[0], lowest), highest)]


def _mm(value: float) -> str:
    """Format thousandths with three digits and without an exponent."""
    return f"{float(f'{1e3 * value:.3g}'):g}"


def _um(value_m: float) -> str:
    return f"{float(f'{1e6 * value_m:.3g}'):g}"
