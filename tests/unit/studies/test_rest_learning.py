"""Learning of what a rest adds to friction, on a table whose breakaway grows at rest."""

import math
from pathlib import Path

import numpy as np
import pytest

from hil_sim.physics.friction import dwell_dependent_breakaway
from servo_ctrl.config.load import load_machine
from servo_ctrl.learning import waveform_run
from servo_ctrl.learning.rest_force import ITERATIONS, rest_time_s, strokes_of
from servo_ctrl.learning.rest_strokes import moves_behind_rests, rest_starts
from servo_ctrl.learning.waveform_run import WaveformRun
from servo_ctrl.motion.move import Dwell, Move
from studies.feng_2015.waveform_learning import ErrorStrokes, LearnedWaveforms, learn_waveforms, with_learned
from studies.random_plants import each_axis
from studies.twin_axis import motion
from twin.plant_file import load_plant

XY_TABLE = Path(__file__).parents[3] / "machines" / "xy_table"
LOADED = load_machine(XY_TABLE)
MACHINE = LOADED.model_copy(update={"learning": LOADED.learning.model_copy(update={"rests_s": [0.3, 3.0]})})
GROWTH = dwell_dependent_breakaway.Params(growth_n=3.0, time_s=1.0, way_m=50e-6)
PLANT = each_axis(
    load_plant(XY_TABLE),
    lambda axis: axis.model_copy(update={"effects": axis.effects | {"dwell_dependent_breakaway": GROWTH}}),
)
T = 1e-3


@pytest.fixture(scope="module")
def learned() -> LearnedWaveforms:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(waveform_run, "ACCELERATIONS", 4)
        return learn_waveforms(MACHINE, PLANT, "x")


def test_what_a_rest_adds_is_learned_stroke_by_stroke(learned: LearnedWaveforms) -> None:
    scores_m = np.array([j_m for stage, _, j_m in learned.course if stage == "rest"]).reshape(2, ITERATIONS)
    for first_m, *_, last_m in scores_m.tolist():
        assert last_m < 0.35 * first_m
    assert [row.rest_s for row in learned.learned.rests] == [0.3, 3.0]
    short, long = learned.learned.rests
    for kind in ("onward_n", "turned_n"):
        growth = max(getattr(long, kind)) / max(getattr(short, kind))
        assert 1.3 < growth < -math.expm1(-3.0) / -math.expm1(-0.3)  # of the plant, less what no rest adds
    assert learned.learned.after_m < 0.1 * learned.learned.before_m


@pytest.mark.parametrize(("end_m", "share"), [(0.02, 0.5), (0.0, 0.9)], ids=["on", "back"])
def test_a_start_behind_a_rest_that_was_not_learned(
    learned: LearnedWaveforms, end_m: float, share: float
) -> None:
    steps = [Move("there", (0.01, math.nan), 0.03, 0.2, trapezoidal=False), Dwell("rest", 1.5)]
    steps += [Move("start", (end_m, math.nan), 0.03, 0.2, trapezoidal=False)]
    strokes = ErrorStrokes(MACHINE, PLANT, "x")
    reference = motion(MACHINE, "x", steps)
    (begin,) = moves_behind_rests(reference[:, 0], 1.0, T)
    means_m = []
    for entry in (learned.learned._replace(rests=()), learned.learned):
        error_m = strokes.error_m(reference.copy(), with_learned(strokes.params, entry))
        means_m.append(float(np.abs(error_m[begin : begin + 200]).mean()))
    assert means_m[1] < share * means_m[0]


def test_rests_are_counted_in_strokes_and_time(learned: LearnedWaveforms) -> None:
    settings = ErrorStrokes(MACHINE, PLANT, "x").settings
    assert settings.rests_s == (0.3, 3.0)
    assert WaveformRun(settings).outlook.strokes_total == 58 + 2 * ITERATIONS
    rests_s = sum(map(rest_time_s, strokes_of(settings)))
    assert rests_s == pytest.approx(ITERATIONS * 4 * 3.3)
    assert learned.learned.machine_time_s > rests_s
    assert WaveformRun(settings._replace(rests_s=())).outlook.strokes_total == 58


def test_a_stroke_without_its_rests_is_refused() -> None:
    with pytest.raises(ValueError, match=r"the stroke has 0 rests of 3 s, not 4"):
        rest_starts(np.linspace(0.0, 1.0, 100), 3.0, T)
