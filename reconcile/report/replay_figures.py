"""The closed-loop replay as a figure: recorded force and both models where the nominal error is largest."""

from collections.abc import Container, Sequence

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
    found: dict[str, Figure] = {}
    for one in comparisons:
        if one.axis not in found:
            found[one.axis] = _figure(one, buckets, unit_of("N", rotary=one.axis in rotary))
    return found


def _figure(one: ReplayComparison, buckets: int, unit: str) -> Figure:
    nominal, repaired = one.nominal, one.repaired
    start, end = _worst_interval(one)
    time_s = nominal.time_s[start:end]
    data = []
    for role, name, force_n in (
        ("ink", "recorded", nominal.force_n),
        ("before", MODEL_NAMES["before"], nominal.replayed_force_n),
        ("after", MODEL_NAMES["after"], repaired.replayed_force_n),
    ):
        data.append(line(role, *thinned(time_s, force_n[start:end], buckets), name=name))
    data[-1]["line"]["dash"] = "dot"  # a good model coincides with the recording, which must stay visible
    for role, run in (("before", nominal), ("after", repaired)):
        error_n = (run.replayed_force_n - run.force_n)[start:end]
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
    drawing = stacked(f"motor force ({unit})", f"error ({unit})", lower_height=0.34)
    return Figure("replay", "Force in the closed loop", note, data, drawing)


def _worst_interval(one: ReplayComparison) -> tuple[int, int]:
    """Return the first and last sample of the interval with the largest force error of the nominal model."""
    squares = (one.nominal.replayed_force_n - one.nominal.force_n) ** 2
    width = int(np.searchsorted(one.nominal.time_s, SHOWN_S))
    if width >= len(squares):
        return 0, len(squares)
    total = np.concatenate(([0.0], np.cumsum(squares)))
    start = int((total[width:] - total[:-width]).argmax())
    return start, start + width
