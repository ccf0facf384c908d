"""Motions that tell effects apart, with numbers: within what the axis was seen to do, and above its noise."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.scenes import FILTER_HZ

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from reconcile.next_experiment_recorded import Recorded

    Sizes = Mapping[str, float]

SLOW_M_S = 0.02
"""Below it friction depends on the speed most."""
FAST = 0.3
"""Of the highest speed."""
SMALL_M = 1e-5
SMALL_HZ = 5.0
"""Slow enough for the filters to see the reversal, fast enough to be no standstill."""
COASTING_S = 0.1
WARM_K, WARM_S = 5.0, 600.0
"""An axis that ran for so long, where nobody measured, or warmed so much, was recorded warm."""
ENOUGH = 3
"""Speeds, dwells, starts each way."""


class Experiment(NamedTuple):
    """A motion by name."""

    motion: str
    numbers: Callable[[Recorded, Sizes], dict[str, Any]]
    """From what was recorded and from the parameters that were found, in units that one reads."""
    done: Callable[[Recorded], bool]
    """Whether the recordings have it already; edges all have."""
    sensor: bool = False
    """It takes more than a motion."""


def _floor(value: float) -> float:
    """Two digits, never more than it was."""
    if value <= 0.0:
        return 0.0
    digits = math.floor(math.log10(value)) - 1
    return float(f"{math.floor(value * 10.0**-digits * (1.0 + 1e-9)) * 10.0**digits:.2g}")


def _within(values: Iterable[float], lowest: float, highest: float, factor: float) -> list[float]:
    """Each once, in the unit that is read; where none is allowed, the one nearest to it."""
    wanted = sorted(values)
    allowed = [value for value in wanted if lowest <= value <= highest]
    chosen = allowed or [min(max(wanted[0], lowest), highest)]
    return list(dict.fromkeys(_floor(value * factor) for value in chosen))


def _speeds(axis: Recorded, wanted: Iterable[float]) -> dict[str, Any]:
    speeds = _within(wanted, 3.0 * axis.creep_m_s, axis.fastest_m_s, 1e3)
    longest_s = 0.8 * axis.travel_m / (max(speeds) * 1e-3) if speeds[-1] else 0.0
    return {"speeds_mm_s": speeds, "directions": "both", "hold_s": _floor(min(2.0, longest_s))}


def _span(axis: Recorded) -> dict[str, Any]:
    return {"from_mm": round(axis.lowest_m * 1e3, 3), "to_mm": round(axis.highest_m * 1e3, 3)}


def _accelerations(axis: Recorded) -> dict[str, Any]:
    shares = (0.1, 0.3, 1.0)
    accelerations = [_floor(share * axis.hardest_m_s2 * 1e3) for share in shares]
    return {
        "accelerations_mm_s2": accelerations,
        "forces_n": [_floor(axis.mass_kg * a * 1e-3) for a in accelerations],
    }


def _slow(axis: Recorded, sizes: Sizes) -> dict[str, Any]:
    bend_m_s = sizes.get("stribeck_m_s", 4e-3)
    return _speeds(axis, (share * bend_m_s for share in (0.25, 0.5, 1.0, 2.0, 4.0)))


def _wide(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    return _speeds(axis, (share * axis.fastest_m_s for share in (0.1, 0.25, 0.5, 0.75, 1.0))) | _span(axis)


def _breakaway(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    places = [round((axis.lowest_m + share * axis.travel_m) * 1e3, 3) for share in (0.2, 0.5, 0.8)]
    return {
        "positions_mm": places,
        "directions": "both",
        "speed_mm_s": _floor(min(10.0 * axis.creep_m_s, axis.fastest_m_s) * 1e3),
        "dwells_s": [1.0],
        "times": 5,
    }


def _dwells(axis: Recorded, sizes: Sizes) -> dict[str, Any]:
    time_s = sizes.get("time_s", 1.0)
    dwells = [_floor(max(share * time_s, 0.1)) for share in (0.1, 0.3, 1.0, 3.0, 10.0)]
    return _breakaway(axis, sizes) | {"dwells_s": list(dict.fromkeys(dwells))}


def _small(axis: Recorded, sizes: Sizes) -> dict[str, Any]:
    way_m = sizes.get("way_m", sizes.get("play_m", 0.5 * SMALL_M))
    w = 2.0 * math.pi * SMALL_HZ
    longest_m = 2.0 * min(axis.hardest_m_s2 / w**2, axis.fastest_m_s / w, 0.4 * axis.travel_m)
    return {
        "strokes_um": _within((s * way_m for s in (0.2, 0.5, 1.0, 2.0, 5.0)), axis.finest_m, longest_m, 1e6),
        "frequency_hz": SMALL_HZ,
        "cycles": 20,
        "record": "apart from faster motions, whose noise hides them",
    }


def _loaded(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    return {"stroke_mm": _floor(0.5e3 * axis.travel_m), **_accelerations(axis), "times": 5}


def _accelerated(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    return _span(axis) | _accelerations(axis)


def _fast_and_hard(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    speeds = [_floor(share * axis.fastest_m_s * 1e3) for share in (0.25, 0.5, 1.0)]
    return {
        "speeds_mm_s": speeds,
        "acceleration_mm_s2": _floor(axis.hardest_m_s2 * 1e3),
        "directions": "both",
    }


def _zero_force(axis: Recorded, sizes: Sizes) -> dict[str, Any]:
    """Friction alone slows the axis down so fast: around it the force passes zero in full motion."""
    coasting_m_s2 = max(axis.coulomb_n, sizes.get("threshold_n", 0.0)) / max(axis.mass_kg, 1e-9)
    slower = _within((s * coasting_m_s2 for s in (0.5, 0.8, 1.2, 2.0)), 0.0, axis.hardest_m_s2, 1e3)
    return {
        "speed_mm_s": _floor(0.5e3 * axis.fastest_m_s),
        "decelerations_mm_s2": slower,
        "directions": "both",
    }


def _edges(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    found = []
    for hertz in (2.0, 5.0, 10.0, 20.0, 40.0):
        w = 2.0 * math.pi * hertz
        amplitude_m = min(axis.hardest_m_s2 / w**2, axis.fastest_m_s / w, 0.4 * axis.travel_m)
        if hertz < FILTER_HZ and amplitude_m > axis.finest_m:
            found.append((hertz, _floor(amplitude_m * 1e6)))
    return {"frequencies_hz": [f for f, _ in found], "amplitudes_um": [a for _, a in found], "cycles": 10}


def _warm(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    ran_s = max(WARM_S, _floor(5.0 * axis.longest_s))
    record = {} if axis.warmed_k is not None else {"record_too": "temperature"}
    speed = {"speed_mm_s": _floor(0.7e3 * axis.fastest_m_s)}
    return {
        "warm_up_s": ran_s,
        **speed,
        **_span(axis),
        "then": "repeat the recordings, again after cooling",
        **record,
    }


def _others(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    return {"order": "this axis alone, the others alone, all", "others": list(axis.others), **_span(axis)}


def _added_mass(axis: Recorded, sizes: Sizes) -> dict[str, Any]:
    known_kg = max(sizes.get("mass_kg", 0.0), 0.1 * axis.mass_kg)
    return {"added_mass_kg": _floor(known_kg), **_accelerations(axis)}


def _third_sensor(axis: Recorded, _sizes: Sizes) -> dict[str, Any]:
    places = [round(k * axis.lead_m * 1e3 / 8.0, 4) for k in range(9)]
    return {"record_too": "the table, by an interferometer", "steps_mm": places}


def _scale(axis: Recorded, sizes: Sizes) -> dict[str, Any]:
    return {"record_too": "the table, by a scale", **_loaded(axis, sizes)}


def _spread(values: tuple[float, ...], factor: float, enough: int = ENOUGH) -> bool:
    """Enough of them, over a factor."""
    return len(values) >= enough and values[-1] >= factor * max(values[0], 1e-12)


EXPERIMENTS = {
    "slow speeds": Experiment(
        "slow constant speeds",
        _slow,
        lambda r: _spread(tuple(v for v in r.steady_m_s if v < SLOW_M_S), 3.0, 2),
    ),
    "speeds": Experiment(
        "constant speeds over the same places",
        _wide,
        lambda r: _spread(r.steady_m_s, 4.0) and r.steady_m_s[-1] > FAST * r.fastest_m_s,
    ),
    "breakaway": Experiment(
        "slow starts from rest in both directions", _breakaway, lambda r: min(r.starts) >= ENOUGH
    ),
    "dwells": Experiment(
        "slow starts after rests of several lengths", _dwells, lambda r: _spread(r.dwells_s, 10.0)
    ),
    "small strokes": Experiment(
        "small strokes to and fro",
        _small,
        lambda r: sum(r.finest_m < s < SMALL_M for s in r.strokes_m) > ENOUGH,
    ),
    "reversals": Experiment(
        "reversals under several forces",
        _loaded,
        lambda r: _spread(r.reversal_m_s2[len(r.reversal_m_s2) // 4 :], 3.0),
    ),
    "accelerations": Experiment(
        "several accelerations over the same places", _accelerated, lambda r: r.hardly_to_hard >= ENOUGH
    ),
    "fast and hard": Experiment(
        "full acceleration up to several speeds", _fast_and_hard, lambda r: r.fast_and_hard
    ),
    "zero force": Experiment(
        "decelerations around that of friction alone", _zero_force, lambda r: r.coasting_s > COASTING_S
    ),
    "edges": Experiment("sines of rising frequency", _edges, lambda _: True),
    "warm": Experiment(
        "the same recordings cold and warm",
        _warm,
        lambda r: r.longest_s >= WARM_S if r.warmed_k is None else r.warmed_k >= WARM_K,
    ),
    "one by one": Experiment("one axis after the other", _others, lambda r: r.alone),
    "added mass": Experiment(
        "several accelerations with a known mass added", _added_mass, lambda _: False, sensor=True
    ),
    "third sensor": Experiment("steps over a turn", _third_sensor, lambda _: False, sensor=True),
    "scale": Experiment("reversals under several forces", _scale, lambda r: r.has_scale, sensor=True),
}
