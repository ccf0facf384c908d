"""Learning in the batch twin, as a program of its own: hours of machine time in about a minute.

The twin knows the plant; nothing of servo_ctrl does. It is started as the simulator is, and leaves a store
of learned functions and the list of its strokes.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from servo_ctrl.config.load import load_machine
from servo_ctrl.experiment.twin_process import TwinError, run_twin
from servo_ctrl.learning.types import Pulse, Stroke
from servo_ctrl.telemetry.learned_store import LearnedStore

if TYPE_CHECKING:
    from pathlib import Path

    from servo_ctrl.learning.types import Learned

TWIN_LIMIT_S = 500.0
"""The paper's learner takes a minute on two idle cores."""


class TwinStroke(NamedTuple):
    """A stroke that the twin made, and its J over Tm, metres."""

    stroke: Stroke
    evaluation_m: float


class TwinAxis(NamedTuple):
    """What one axis learned."""

    learned: Learned
    strokes: list[TwinStroke]
    wall_s: float

    @property
    def times_real_time(self) -> float:
        """Machine time of the strokes against the time they took."""
        return self.learned.machine_time_s / self.wall_s


class TwinLearning(NamedTuple):
    """What all axes learned; `store` is the directory of the functions."""

    store: Path
    axes: dict[str, TwinAxis]
    wall_s: float


def learn_in_twin(machine: Path, store: Path, learner: str) -> TwinLearning:
    """Learn all axes of the machine's plant; blocks for as long as it takes. Raises ServoCtrlError."""
    store.mkdir(parents=True, exist_ok=True)
    figures = store / f"strokes-{learner}.json"
    arguments = ["--machine", str(machine), "--out", str(store), "--learner", learner, "--json", str(figures)]
    run_twin("reconcile.learning", arguments, TWIN_LIMIT_S)
    config = load_machine(machine)
    stored = LearnedStore(store, config)
    try:
        document = json.loads(figures.read_text(encoding="utf-8"))
        axes = {}
        for name, entry in document["axes"].items():
            result = stored.active(name)
            if result is None:
                raise TwinError(f"{store}: the batch twin has stored nothing for axis {name}")
            axes[name] = TwinAxis(result.learned, _strokes(entry["strokes"]), float(entry["wall_s"]))
        return TwinLearning(store, axes, float(document["wall_s"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise TwinError(f"{figures}: is no list of the twin's strokes: {error!r}") from None


def _strokes(entries: list[dict[str, Any]]) -> list[TwinStroke]:
    return [
        TwinStroke(
            Stroke(
                str(entry["stage"]), float(entry["acceleration_m_s2"]), Pulse(*map(float, entry["pulse"]))
            ),
            float(entry["evaluation_m"]),
        )
        for entry in entries
    ]
