"""Learning in the batch twin: both learners, another machine, and adaptation when friction has changed."""

from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil_sim.config import PlantConfig, load_plant
from servo_ctrl.config.learning import learning_settings
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learning import fast, schedule
from servo_ctrl.learning.adaptation import adapted
from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.stroke_result import evaluation_m, first_samples
from servo_ctrl.learning.types import NO_PULSE, Learned, Pulse, Stroke, StrokeResult
from studies.feng_2015 import twin_learning as learning
from studies.feng_2015.twin_learning import LearnedAxis, StrokeTwin, learn_axis

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"
REDUCED = {
    "accelerations_mm_s2": [30.0, 50.0, 80.0, 120.0],
    "steps": [1, 1, 1],
    "coarse_steps": 9,
    "fine_steps": 8,
    "duration_step_ms": 5.0,
}
PLACES = 4
"""Accelerations at which the faster learner learns here."""


def changed(machine: MachineConfig, **values: Any) -> MachineConfig:
    return machine.model_copy(update={"learning": machine.learning.model_copy(update=values)})


def with_friction(plant: PlantConfig, factor: float) -> PlantConfig:
    """The plant with another Coulomb friction of x."""
    axis = plant.axes["x"]
    coulomb = axis.effects["coulomb_friction"]
    effects = {**axis.effects, "coulomb_friction": coulomb._replace(coulomb_n=coulomb.coulomb_n * factor)}
    return plant.model_copy(
        update={"axes": {**plant.axes, "x": axis.model_copy(update={"effects": effects})}}
    )


@pytest.fixture(scope="module")
def reduced() -> dict[str, LearnedAxis]:
    """What both learners found on x, over few and short strokes."""
    machine, plant = changed(load_machine(MACHINE), **REDUCED), load_plant(MACHINE)
    with pytest.MonkeyPatch.context() as patch:
        for module in (fast, schedule):
            patch.setattr(module, "ACCELERATIONS", PLACES)
        return {learner: learn_axis(machine, plant, "x", learner) for learner in ("paper", "fast")}


def test_both_learners_remove_most_of_the_error(reduced: dict[str, LearnedAxis]) -> None:
    for found in reduced.values():
        assert found.learned.after_m <= 0.25 * found.learned.before_m


def test_the_faster_learner_is_as_good_with_a_quarter_of_the_strokes(reduced: dict[str, LearnedAxis]) -> None:
    paper, quick = reduced["paper"].learned, reduced["fast"].learned
    assert quick.after_m <= 1.05 * paper.after_m
    assert quick.strokes <= paper.strokes / 4
    assert quick.machine_time_s <= paper.machine_time_s / 4


def test_the_papers_learner_keeps_the_best_of_each_sweep(reduced: dict[str, LearnedAxis]) -> None:
    found = reduced["paper"]
    kept = dict(found.learned.amplitudes)
    fine = [entry for entry in found.strokes if entry.stroke.stage == "fine"]
    for a, group in groupby(fine, key=lambda entry: entry.stroke.acceleration_m_s2):
        strokes = list(group)
        least = min(strokes, key=lambda entry: entry.evaluation_m)
        assert kept[a] == least.stroke.pulse.amplitude_m_s
        assert len(strokes) == REDUCED["fine_steps"] + 1


def test_the_second_trapezoid_makes_it_better(reduced: dict[str, LearnedAxis]) -> None:
    machine, plant = changed(load_machine(MACHINE), **REDUCED), load_plant(MACHINE)
    settings, twin = learning_settings(machine, "x"), StrokeTwin(machine, plant, "x")
    for found in reduced.values():
        scores = []
        for learned in (found.learned, found.learned._replace(trailing=())):
            results = [twin.stroke(Stroke("", a, pulse_at(learned, a)), settings) for a in (0.04, 0.1)]
            scores.append(np.mean([evaluation_m(result, settings.window_s) for result in results]))
        assert scores[0] <= 0.9 * scores[1]


def test_a_stroke_in_the_twin_is_the_same_every_time() -> None:
    machine = changed(load_machine(MACHINE), **REDUCED)
    settings, stroke = learning_settings(machine, "x"), Stroke("", 0.1, Pulse(0.05, 0.001))
    twin = StrokeTwin(machine, load_plant(MACHINE), "x")
    first = twin.stroke(stroke, settings)
    twin.stroke(Stroke("", 0.1, NO_PULSE), settings)
    assert (twin.stroke(stroke, settings).error_m == first.error_m).all()


@pytest.mark.parametrize("period_us", [250, 2000])
def test_strokes_at_other_sync_periods_have_like_errors(period_us: int) -> None:
    plant, stroke = load_plant(MACHINE), Stroke("", 0.1, NO_PULSE)
    scores = []
    for sync_us in (1000, period_us):
        machine = load_machine(MACHINE)
        machine = machine.model_copy(
            update={"bus": machine.bus.model_copy(update={"sync_period_us": sync_us})}
        )
        settings = learning_settings(machine, "x")
        result = StrokeTwin(machine, plant, "x").stroke(stroke, settings)
        assert result.period_s == pytest.approx(sync_us * 1e-6)
        assert result.error_m.shape[1] == int(0.8 / result.period_s)
        scores.append(evaluation_m(result, settings.window_s))
    assert scores[1] == pytest.approx(scores[0], rel=0.15)


def test_an_axis_without_a_scale_learns_from_its_motor() -> None:
    machine = load_machine(MACHINE)
    axis = machine.axes["x"]
    blind = axis.model_copy(
        update={"scale": None, "control": axis.control.model_copy(update={"feedback": "motor"})}
    )
    machine = machine.model_copy(update={"axes": {**machine.axes, "x": blind}})
    settings = learning_settings(machine, "x")
    result = StrokeTwin(machine, load_plant(MACHINE), "x").stroke(Stroke("", 0.1, NO_PULSE), settings)
    assert 1e-6 < evaluation_m(result, settings.window_s) < 20e-6


def production(learned: Learned, factor: float, reversals: int) -> list[float]:
    """J of each turn of an R 25 mm, F 1000 mm/min circle's x axis, adapting from every reversal."""
    machine = changed(load_machine(MACHINE), radius_mm=25.0)
    settings, scores = learning_settings(machine, "x"), []
    twin = StrokeTwin(machine, with_friction(load_plant(MACHINE), factor), "x")
    a = (1000.0 / 60.0) ** 2 / 25.0 * 1e-3
    for _ in range(reversals // 2):
        result = twin.stroke(Stroke("", a, pulse_at(learned, a)), settings)
        scores.append(evaluation_m(result, settings.window_s))
        for row in first_samples(result, settings.window_s):
            learned = adapted(learned, settings, a, StrokeResult(row[None, :], result.period_s)) or learned
    return scores


FROM_THE_TWIN = Learned(
    "fast",
    ((0.002, 0.168), (0.0056, 0.107), (0.0093, 0.0913), (0.015, 0.0918), (0.12, 0.041)),
    ((0.002, 0.000185), (0.0056, 0.000323), (0.0093, 0.00043), (0.015, 0.000515), (0.12, 0.002)),
    0.0,
    ((0.002, 0.149, 0.098, 6.6e-5), (0.0093, 0.0713, 0.0731, 1.25e-4), (0.015, 0.159, 0.04, -2.5e-4)),
    5.5e-6,
    0.67e-6,
    67,
    1100.0,
)
"""What x learned there, at some of the points."""


def test_adaptation_follows_when_friction_has_changed() -> None:
    scores = production(FROM_THE_TWIN, 1.3, 60)
    assert scores[-1] <= 0.75 * scores[0]


def test_adaptation_leaves_functions_alone_that_fit() -> None:
    scores = production(FROM_THE_TWIN, 1.0, 60)
    assert scores[-1] <= 1.05 * scores[0]
    assert max(scores) <= 1.05 * scores[0]


def test_every_axis_is_stored_with_its_strokes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reduced: dict[str, LearnedAxis]
) -> None:
    monkeypatch.setattr(learning, "learn_axis", lambda *_axis: reduced["fast"])
    found = learning.learn_in_twin(MACHINE, tmp_path / "out", "fast")
    assert list(found.axes) == ["x", "y"]
    stored = LearnedStore(tmp_path / "out", load_machine(MACHINE)).active("x")
    assert stored is not None
    assert stored.learned == found.axes["x"].learned == reduced["fast"].learned
    assert len(found.axes["x"].strokes) == stored.learned.strokes
    checks = [entry.evaluation_m for entry in found.axes["x"].strokes if entry.stroke.stage == "check"]
    assert np.mean(checks[1::2]) == pytest.approx(stored.learned.after_m)
