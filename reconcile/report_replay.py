"""The closed-loop replay as a picture: the force recorded and by both models, where the nominal is worst."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.report_figures import Figure
from reconcile.report_traces import NAMES, axis, layout, line
from servo_ctrl.telemetry.min_max import thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.replay_models import Replayed

SHOWN_S = 4.0


def replay_figures(done: Sequence[Replayed], buckets: int) -> dict[str, Figure]:
    """By axis: its first recording."""
    found: dict[str, Figure] = {}
    for one in done:
        if one.axis not in found:
            found[one.axis] = _figure(one, buckets)
    return found


def _figure(one: Replayed, buckets: int) -> Figure:
    start, end = _worst(one)
    time_s = one.before.time_s[start:end]
    data = []
    for role, name, force_n in (
        ("ink", "recorded", one.before.force_n),
        ("before", NAMES["before"], one.before.replayed_force_n),
        ("after", NAMES["after"], one.after.replayed_force_n),
    ):
        x, y = thinned(time_s, force_n[start:end], buckets)
        data.append(line(role, x, y, name=name))
    data[-1]["line"]["dash"] = "dot"  # where it is right it lies on the recording
    for role, run in (("before", one.before), ("after", one.after)):
        x, y = thinned(time_s, (run.replayed_force_n - run.force_n)[start:end], buckets)
        data.append({**line(role, x, y, name=f"error, {NAMES[role]}"), "yaxis": "y2", "showlegend": False})
    page = layout("time (s)", "motor force (N)")
    page["xaxis"].update(anchor="y2", domain=[0.0, 1.0])
    page["yaxis"]["domain"] = [0.42, 1.0]
    page["yaxis2"] = {**axis("error (N)"), "domain": [0.0, 0.34]}
    page["height"] = 430
    stretch = f"{SHOWN_S:g} s in which the nominal model is furthest off"
    if end - start == len(one.before.time_s):
        stretch = "all of it"
    note = (
        f"{one.before.source}, {stretch}. Below: replayed less recorded. The known controller leads each "
        "model along the recorded reference; nothing else of the recording goes in but where and "
        "how fast the axis began."
    )
    return Figure("replay", "Force in the closed loop", note, data, page)


def _worst(one: Replayed) -> tuple[int, int]:
    """Samples of the stretch where the nominal model's force errs most."""
    time_s = one.before.time_s
    squares = (one.before.replayed_force_n - one.before.force_n) ** 2
    width = int(np.searchsorted(time_s, SHOWN_S))
    if width >= len(squares):
        return 0, len(squares)
    total = np.concatenate(([0.0], np.cumsum(squares)))
    start = int((total[width:] - total[:-width]).argmax())
    return start, start + width
