"""Experiments that take more than a motion: a sensor, a known mass, an hour, the other axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.next_experiment_rules import takes_more, told_apart

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from reconcile.explain import Explanation
    from reconcile.next_experiment_recorded import Recorded

WARM_K, WARM_S = 5.0, 600.0
"""An axis that ran for so long, where nobody measured, or warmed so much, was recorded warm."""


class ByHand(NamedTuple):
    """An experiment by name."""

    motion: str
    numbers: Callable[[Recorded], dict[str, Any]]
    """In units that one reads."""
    lacking: Callable[[Recorded], bool]
    """Whether it is worth asking for where nothing else is open."""
    shows: tuple[str, ...]
    """What would not have shown without it, the most likely first."""


EXPERIMENTS = {
    "scale": ByHand(
        "reversals under several forces",
        lambda _: {"record_too": "the table, by a scale"},
        lambda r: not r.has_scale,
        ("backlash", "drive_compliance"),
    ),
    "one by one": ByHand(
        "one axis after the other",
        lambda r: {"order": "this axis alone, the others alone, all", "others": list(r.others)},
        lambda r: not r.alone,
        ("cross_axis_coupling", "position_dependent_force"),
    ),
    "warm": ByHand(
        "the same recordings cold and warm",
        lambda r: {
            "warm_up_s": max(WARM_S, round(5.0 * r.longest_s)),
            "speed_mm_s": float(f"{0.7e3 * r.fastest_m_s:.2g}"),
            "then": "repeat the recordings, again after cooling",
            **({"record_too": "temperature"} if r.warmed_k is None else {}),
        },
        lambda r: r.longest_s < WARM_S if r.warmed_k is None else r.warmed_k < WARM_K,
        ("temperature_dependent_friction", "thermal_expansion"),
    ),
    "breakaway": ByHand(
        "slow starts from rest in both directions",
        lambda _: {"dwells_s": [1.0], "times": 5, "directions": "both"},
        lambda _: False,
        (),
    ),
    "added mass": ByHand(
        "several accelerations with a known mass added",
        lambda r: {"added_mass_kg": float(f"{0.1 * r.mass_kg:.2g}")},
        lambda _: False,
        (),
    ),
    "third sensor": ByHand(
        "steps over a turn",
        lambda r: {
            "record_too": "the table, by an interferometer",
            "steps_mm": [round(k * r.lead_m * 1e3 / 8.0, 4) for k in range(9)],
        },
        lambda _: False,
        (),
    ),
}


def by_hand(
    known: Mapping[str, Recorded], explanations: Mapping[str, Sequence[Explanation]]
) -> dict[str, Any]:
    """The first that would tell something; empty where there is none."""
    wanted = [*_alike(explanations), *_lacking(known)]
    if not wanted:
        return {}
    axis, experiment, separates, why = wanted[0]
    one = EXPERIMENTS[experiment]
    return {
        "why": why,
        "separates": list(separates),
        "axis": axis,
        "motion": one.motion,
        **one.numbers(known[axis]),
        "tells": told_apart(separates[0], separates[-1]),
    }


def _alike(
    explanations: Mapping[str, Sequence[Explanation]],
) -> Iterator[tuple[str, str, tuple[str, ...], str]]:
    """Names that no motion tells apart."""
    for axis, of_axis in explanations.items():
        for finding in (one for e in of_axis for one in e.findings):
            for other in finding.equivalent:
                if experiment := takes_more(finding.effect, other):
                    pair = (finding.effect, other)
                    words = " from ".join(name.replace("_", " ") for name in pair)
                    yield axis, experiment, pair, f"no motion tells {words} by these sensors"


def _lacking(known: Mapping[str, Recorded]) -> Iterator[tuple[str, str, tuple[str, ...], str]]:
    for axis, seen in known.items():
        for name, one in EXPERIMENTS.items():
            if one.lacking(seen):
                shown = " and ".join(effect.replace("_", " ") for effect in one.shows)
                what = "no scale was recorded" if name == "scale" else f"these recordings lack {one.motion}"
                yield axis, name, one.shows, f"{what}: {shown} would hardly show"
