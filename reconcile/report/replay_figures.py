"""The closed-loop replay as a figure: recorded force and both models where the nominal error is largest."""

from collections.abc import Container, Sequence
from typing import NamedTuple

import numpy as np

from reconcile.formats.rotary_units import unit_of
from reconcile.replay.model_replays import ReplayComparison
from reconcile.report.traces import MODEL_NAMES, Figure, line, stacked
from servo_ctrl.recording.min_max import thinned

SHOWN_S = 4.0
"""Duration of the interval: enough for several reversals, short enough to see a single one."""


def replay_figures(
    comparisons: Sequence[ReplayComparison], buckets: int, rotary: Container[str] = ()
) -> dict[str, Figure]:
    """Return a figure of the first recording by axis; lines have at most `buckets` of two points.

    `rotary`: the rotary axes.
    """
    by_axis: dict[str, Figure] = {}
    for comparison in comparisons:
        axis = comparison.axis
        if axis not in by_axis:
            by_axis[axis] = _figure(comparison, buckets, unit_of("N", rotary=axis in rotary))
    return by_axis


def _figure(comparison: ReplayComparison, buckets: int, unit: str) -> Figure:
    nominal, repaired = comparison.nominal, comparison.repaired
    start, end = _worst_interval(comparison)
    time_s = nominal.time_s[start:end]
    data = []
    for role, name, force_n in (
        ("ink", "recorded", nominal.force_n),
        ("before", MODEL_NAMES["before"], nominal.replayed_force_n),
        ("after", MODEL_NAMES["after"], repaired.replayed_force_n),
    ):
        data.append(line(role, *thinned(time_s, force_n[start:end], buckets), name=name))
    data[-1]["line"]["dash"] = "dot"  # a good model coincides with the recording, which must stay visible
    for role, replay in (("before", nominal), ("after", repaired)):
        error_n = (replay.replayed_force_n - replay.force_n)[start:end]
        trace = line(role, *thinned(time_s, error_n, buckets), name=f"error, {MODEL_NAMES[role]}")
        data.append({**trace, "yaxis": "y2", "showlegend": False})
    interval = f"{SHOWN_S:g} s in which the nominal model is furthest off"
    if end - start == len(nominal.time_s):
        interval = "all of it"
    note = (
        f"{nominal.source}, {interval}. Below: replayed less recorded. The known controller leads each "
        "model along the recorded reference; nothing else of the recording goes in but where and "
        "how fast the axis began."
    )
    figure_layout = stacked(f"motor force ({unit})", f"error ({unit})", lower_height=0.34)
    return Figure("replay", "Force in the closed loop", note, data, figure_layout)


class _Interval(NamedTuple):
    start: int
    end: int
    """One past the last sample."""


def _worst_interval(comparison: ReplayComparison) -> _Interval:
    """Return the interval with the largest squared force error of the nominal model."""
    nominal = comparison.nominal
    squares = (nominal.replayed_force_n - nominal.force_n) ** 2
    width = int(np.searchsorted(nominal.time_s, SHOWN_S))
    if width >= len(squares):
        return _Interval(0, len(squares))
    cumulated = np.concatenate(([0.0], np.cumsum(squares)))
    start = int((cumulated[width:] - cumulated[:-width]).argmax())
    return _Interval(start, start + width)
