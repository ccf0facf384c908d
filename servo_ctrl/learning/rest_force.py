"""Learns what a rest adds to friction (`control.rest_memory`), relative to the waveform without rests.

The learning law is that of `learning.reversal_waveform`, over the time since the start; the table holds its
result over the travel. One acceleration is learned, as friction that a rest adds depends on the travel above
all.
"""

import math
from collections.abc import Generator

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.rest_strokes import TURNS
from servo_ctrl.learning.reversal_waveform import (
    LoopModel,
    RestForce,
    corrected,
    mean_around_reversals,
    missing_force_n,
    rest_travels_m,
    samples_of,
)
from servo_ctrl.learning.types import NO_PULSE, Stroke
from servo_ctrl.learning.waveform_stroke import (
    GAIN,
    WaveformResult,
    WaveformSettings,
    WaveformStroke,
    directions_of,
    score_m,
)

NODES = 50
"""Forces of a row over the travel. Chosen: about one a millisecond for a start at 50 m/s^3."""
TAPER_SHARE = 0.2
"""Share of the nodes, at the end, over which a force fades to zero; chosen: the last half of the travel."""
ITERATIONS = 4
"""Strokes for each rest; chosen: each begins with what the shorter one has learned."""
REST = "rest"
"""Stage of the strokes."""


def stroke_of(settings: WaveformSettings, rest_s: float) -> Stroke:
    """The stroke with rests of this duration, its acceleration amid those that production may have."""
    a_m_s2 = math.sqrt(settings.sines.accelerations_m_s2[-1] * settings.largest_m_s2)
    return Stroke(REST, a_m_s2, NO_PULSE, rest_s)


def strokes_of(settings: WaveformSettings) -> list[Stroke]:
    """All strokes with rests, in their order."""
    return [stroke_of(settings, rest_s) for rest_s in settings.rests_s for _ in range(ITERATIONS)]


def rest_time_s(stroke: Stroke) -> float:
    """How long a stroke rests, seconds."""
    return len(TURNS) * stroke.rest_s


def no_rest_force(rest_s: float) -> RestForce:
    """No force behind a rest."""
    return RestForce(rest_s, (0.0,) * NODES, (0.0,) * NODES)


def rest_table(rests: tuple[RestForce, ...]) -> Array | None:
    """The table of the control law, (r, 1 + 2 N); None without a rest."""
    if not rests:
        return None
    return np.array([(row.rest_s, *row.onward_n, *row.turned_n) for row in rests])


def corrected_over_travel(
    force_n: tuple[float, ...], missing_n: Array, travel_m: Array, loop: LoopModel, gain: float
) -> tuple[float, ...]:
    """The next forces of a row from the missing force (n,).

    `travel_m` (n,): of the command at the lead, at the samples of `missing_n`.
    """
    travel_m, nodes_m = np.maximum.accumulate(travel_m), rest_travels_m(loop, NODES)
    wave_n = np.interp(travel_m, [0.0, *nodes_m], [0.0, *force_n], right=0.0)
    wave_n = np.interp(nodes_m, travel_m, corrected(wave_n, missing_n, gain, loop), right=0.0)
    fade = np.clip((1.0 - np.arange(1, NODES + 1) / NODES) / TAPER_SHARE, 0.0, 1.0)
    return tuple((wave_n * np.sin(0.5 * np.pi * fade) ** 2).round(4).tolist())


def learn_rests(
    settings: WaveformSettings, friction: tuple[float, ...], waves: Array
) -> Generator[WaveformStroke, WaveformResult, tuple[RestForce, ...]]:
    """Learn from the shortest rest to the longest, each starting with what was learned last.

    Of each rest the force of least J is kept.
    """
    learned: list[RestForce] = []
    for rest_s in settings.rests_s:
        first = learned[-1]._replace(rest_s=rest_s) if learned else no_rest_force(rest_s)
        learned.append((yield from _learn_rest(settings, friction, waves, first)))
    return tuple(learned)


def _learn_rest(
    settings: WaveformSettings, friction: tuple[float, ...], waves: Array, row: RestForce
) -> Generator[WaveformStroke, WaveformResult, RestForce]:
    best_m, best = np.inf, row
    for _ in range(ITERATIONS):
        result = yield WaveformStroke(stroke_of(settings, row.rest_s), friction, waves, rest_table((row,)))
        j_m = score_m(result, settings)
        if j_m < best_m:
            best_m, best = j_m, row
        row = _corrected_row(row, result, settings.loop)
    return best


def _corrected_row(row: RestForce, result: WaveformResult, loop: LoopModel) -> RestForce:
    ahead, length = round(loop.ahead_s / loop.period_s), samples_of(loop)
    starts, directions = result.reversals, directions_of(result)
    path_m = result.commands[starts[0] - 1 - ahead + loop.dead_samples :, 0][:length]
    travel_m = np.abs(path_m - result.commands[starts[0] - 1, 0])
    missing_n = missing_force_n(loop, result.error_m)

    def next_n(force_n: tuple[float, ...], *, turned: bool) -> tuple[float, ...]:
        here = np.array(TURNS) == turned
        mean_n = mean_around_reversals(missing_n, starts[here], directions[here], length, ahead)
        return corrected_over_travel(force_n, mean_n - mean_n[0], travel_m, loop, GAIN)

    return row._replace(
        onward_n=next_n(row.onward_n, turned=False), turned_n=next_n(row.turned_n, turned=True)
    )
