"""Experiments that need more than a motion: another sensor, a known mass, a warm machine, the other axes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from reconcile.catalogue.registry import CATALOGUE, distinguishing_observation, experiment_by_hand
from reconcile.design.recorded_axis import RecordedAxis
from reconcile.identification.explain import Explanation

WARM_K, WARM_S = 5.0, 600.0
"""Least temperature range, or duration where none was recorded, of an axis that was recorded warm."""


class ManualExperiment(NamedTuple):
    """An experiment by hand, and when to propose it."""

    motion: str
    numbers: Callable[[RecordedAxis], dict[str, Any]]
    """Numbers of the experiment, by keys with readable units."""
    lacking: Callable[[RecordedAxis], bool]
    """Whether the recordings lack it, so that it is proposed where nothing else is open."""


MANUAL_EXPERIMENTS = {
    "scale": ManualExperiment(
        "reversals under several forces",
        lambda _: {"record_too": "the table, by a scale"},
        lambda r: not r.has_scale,
    ),
    "one by one": ManualExperiment(
        "one axis after the other",
        lambda r: {"order": "this axis alone, the others alone, all", "others": list(r.other_axes)},
        lambda r: not r.moved_alone,
    ),
    "warm": ManualExperiment(
        "the same recordings cold and warm",
        lambda r: {
            "warm_up_s": max(WARM_S, round(5.0 * r.longest_recording_s)),
            "speed_mm_s": float(f"{0.7e3 * r.max_velocity_m_s:.2g}"),
            "then": "repeat the recordings, again after cooling",
            **({"record_too": "temperature"} if r.temperature_range_k is None else {}),
        },
        lambda r: (
            r.longest_recording_s < WARM_S
            if r.temperature_range_k is None
            else r.temperature_range_k < WARM_K
        ),
    ),
    "breakaway": ManualExperiment(
        "slow starts from rest in both directions",
        lambda _: {"dwells_s": [1.0], "times": 5, "directions": "both"},
        lambda _: False,
    ),
    "added mass": ManualExperiment(
        "several accelerations with a known mass added",
        lambda r: {"added_mass_kg": float(f"{0.1 * r.mass_kg:.2g}")},
        lambda _: False,
    ),
    "third sensor": ManualExperiment(
        "steps over a turn",
        lambda r: {
            "record_too": "the table, by an interferometer",
            "steps_mm": [round(k * r.lead_m * 1e3 / 8.0, 4) for k in range(9)],
        },
        lambda _: False,
    ),
}


def manual_experiment(
    recorded: Mapping[str, RecordedAxis], explanations: Mapping[str, Sequence[Explanation]]
) -> dict[str, Any]:
    """Return the most useful manual experiment for verdict.json; empty if there is none."""
    proposals = [*_indistinguishable(explanations), *_lacking(recorded)]
    if not proposals:
        return {}
    axis, experiment, separates, why = proposals[0]
    one = MANUAL_EXPERIMENTS[experiment]
    return {
        "why": why,
        "separates": list(separates),
        "axis": axis,
        "motion": one.motion,
        **one.numbers(recorded[axis]),
        "tells": distinguishing_observation(separates[0], separates[-1]),
    }


def _indistinguishable(
    explanations: Mapping[str, Sequence[Explanation]],
) -> Iterator[tuple[str, str, tuple[str, ...], str]]:
    """Yield proposals for pairs of effects that no motion separates."""
    for axis, of_axis in explanations.items():
        for finding in (one for e in of_axis for one in e.findings):
            for other in finding.equivalent:
                if experiment := experiment_by_hand(finding.effect, other):
                    pair = (finding.effect, other)
                    words = " from ".join(name.replace("_", " ") for name in pair)
                    yield axis, experiment, pair, f"no motion tells {words} by these sensors"


def _lacking(recorded: Mapping[str, RecordedAxis]) -> Iterator[tuple[str, str, tuple[str, ...], str]]:
    """Yield proposals for experiments that the recordings lack."""
    for axis, of_axis in recorded.items():
        for name, one in MANUAL_EXPERIMENTS.items():
            if one.lacking(of_axis):
                shows = tuple(effect for effect, entry in CATALOGUE.items() if entry.experiment == name)
                shown = " and ".join(effect.replace("_", " ") for effect in shows)
                what = "no scale was recorded" if name == "scale" else f"these recordings lack {one.motion}"
                yield axis, name, shows, f"{what}: {shown} would hardly show"
