"""Strokes of the twin as programs for the bus."""

from pathlib import Path

import pytest
from friction_results import STROKE, learned, twin

from servo_ctrl.config.learning import stroke_steps
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.config.steps import program_steps
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.learned.store import LearnedStore
from servo_ctrl.learning.pulse_functions import pulse_at
from servo_ctrl.learning.types import Pulse, Stroke
from studies.feng_2015.strokes import RepeatedStroke, _always, _sine, drawn_strokes
from studies.feng_2015.twin_learning import TwinStroke, learn_in_twin
from studies.feng_2015.variants import study_program, without_second_trapezoid

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table"


@pytest.mark.parametrize("acceleration_m_s2", [0.002, 0.0086177, 0.12])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_stroke_as_a_program_is_the_motion_that_learning_makes(axis: str, acceleration_m_s2: float) -> None:
    config = load_machine(MACHINE)
    stroke = Stroke("coarse", acceleration_m_s2, Pulse())
    sine = _sine(config, axis, stroke)
    program = ProgramConfig.model_validate({"source": Path("strokes"), "step": [sine]})
    (ours,) = program_steps(program, config)
    (theirs,) = stroke_steps(config, axis, stroke, [0.0, 0.0])
    assert ours[1:] == pytest.approx(theirs[1:], rel=1e-12)


@pytest.mark.parametrize(
    "pulse",
    [Pulse(0.1, 0.0004), Pulse(0.1, 0.0004, 0.07, 0.06, -0.0002), Pulse(0.03, 0.002, 0.0, 0.06, 1e-4)],
)
def test_functions_made_for_one_stroke_give_its_pulse_at_any_reverse_acceleration(pulse: Pulse) -> None:
    functions = _always(pulse, 0.008)
    for acceleration_m_s2 in (1e-4, 0.0079, 0.008, 0.5):
        assert pulse_at(functions, acceleration_m_s2) == pytest.approx(pulse, rel=1e-12)


def test_strokes_are_drawn_without_repetition_and_the_same_for_the_same_seed() -> None:
    many = [TwinStroke(STROKE._replace(acceleration_m_s2=0.001 * i), 1e-6) for i in range(1, 200)]
    learning = twin(0.8e-6, 199)
    learning = learning._replace(axes={k: v._replace(strokes=many) for k, v in learning.axes.items()})
    first, again, other = (drawn_strokes(learning, 6, seed) for seed in (1, 1, 2))
    assert first == again != other
    for strokes in first.values():
        accelerations = [entry.stroke.acceleration_m_s2 for entry in strokes]
        assert len(set(accelerations)) == 6
        assert accelerations == sorted(accelerations), "in the order in which the twin made them"
    assert first["x"] != first["y"]


def test_asking_for_more_strokes_than_there_are_gives_all() -> None:
    assert drawn_strokes(twin(0.8e-6, 1), 5, 1) == {
        "x": [TwinStroke(STROKE, 1e-6)],
        "y": [TwinStroke(STROKE, 1e-6)],
    }


def test_bus_and_twin_agree_within_a_nanometre() -> None:
    assert RepeatedStroke("x", STROKE, 1e-6, 1e-6 + 0.9e-9).same
    assert not RepeatedStroke("x", STROKE, 1e-6, 1e-6 - 1.1e-9).same
    assert not RepeatedStroke("x", STROKE, 1e-6, float("nan")).same


def test_the_paper_s_pulse_alone_is_the_same_function_without_the_second_trapezoid(tmp_path: Path) -> None:
    config = load_machine(MACHINE)
    store = LearnedStore(tmp_path / "both", config)
    store.add("x", learned(), {"made": "by hand"})
    without_second_trapezoid(MACHINE, store.directory, tmp_path / "single")
    stored = LearnedStore(tmp_path / "single", config).active("x")
    assert stored is not None
    assert stored.learned == learned()._replace(trailing=())
    assert LearnedStore(tmp_path / "single", config).active("y") is None


def test_the_judged_motions_are_not_those_of_learning() -> None:
    config = load_machine(MACHINE)
    kinds = {step.kind for step in study_program(MACHINE).steps}
    assert kinds == {"move", "circle", "dwell", "s_shape"}
    radii = {step.radius_mm for step in study_program(MACHINE).steps if step.kind == "circle"}
    assert radii == {25.0}
    assert config.learning.radius_mm == 50.0


def test_a_machine_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ServoCtrlError, match=r"controller\.toml"):
        learn_in_twin(tmp_path, tmp_path / "store", "fast")
