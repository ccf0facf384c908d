"""Tuning of position laws: evaluated parameters fit the machine file; every law gets as many evaluations."""

import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hil_sim.config import load_plant
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from studies.xia_fuzzy_pd import tuning_cost
from studies.xia_fuzzy_pd.position_tuning import POPULATION, tuned
from studies.xia_fuzzy_pd.tuning_cost import Training
from studies.xia_fuzzy_pd.tuning_laws import LAWS, in_the_file, values_at, with_law

MACHINE = Path(__file__).parents[3] / "machines" / "fuzzy_table"
FILES = {"pid": "controller_pid.toml", "fuzzy_pd": "controller.toml"}


@pytest.fixture(scope="module")
def training() -> Iterator[Training]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tuning_cost, "STEPS_M", (0.2e-3, 1.5e-3))
        patch.setattr(tuning_cost, "SINES", ((2e-3, 1.0),))
        yield Training(load_machine(MACHINE), load_plant(MACHINE), "x")


def linear(**changed: float) -> dict[str, float]:
    return {"kp_1_s": 40.0, "ki_1_s2": 0.1, "kd": 0.0, "derivative_filter_ms": 0.0} | changed


@pytest.mark.parametrize("law", LAWS)
def test_evaluated_parameters_equal_those_of_the_written_machine_file(law: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    values = values_at(law, rng.random(len(LAWS[law])).tolist())
    text = (MACHINE / FILES[law]).read_text(encoding="utf-8").replace("../..", str(MACHINE.parents[1]))
    document = tomllib.loads(text)["axis"]["x"]
    for section, keys in in_the_file(law, values).items():
        for key, value in keys.items():
            text = text.replace(f"{key} = {document[section][key]!r}", f"{key} = {value!r}")
    path = tmp_path / "controller.toml"
    path.write_text(text, encoding="utf-8")
    written = axis_params(load_machine(path), "x")
    judged = with_law(axis_params(load_machine(MACHINE), "x"), law, values)
    assert written.position_loop == pytest.approx(judged.position_loop, rel=1e-12)
    assert written.fuzzy.enabled == judged.fuzzy.enabled == (law == "fuzzy_pd")
    if law == "fuzzy_pd":
        assert written.fuzzy[:-1] == pytest.approx(judged.fuzzy[:-1], rel=1e-12)
        np.testing.assert_array_equal(written.fuzzy.surface, judged.fuzzy.surface)


def test_the_cube_spans_the_bounds() -> None:
    for law, spans in LAWS.items():
        lowest, highest = (values_at(law, [share] * len(spans)) for share in (0.0, 1.0))
        assert lowest == {name: span.lowest for name, span in spans.items()}
        assert highest == {name: span.highest for name, span in spans.items()}


def test_a_loop_of_more_gain_costs_less_until_it_swings(training: Training) -> None:
    slow, good, wild = (training.cost("pid", linear(kp_1_s=kp)) for kp in (25.0, 45.0, 150.0))
    assert good < slow < wild


def test_overshoot_by_the_integral_costs(training: Training) -> None:
    assert training.cost("pid", linear(ki_1_s2=400.0)) > training.cost("pid", linear()) + 1.0


def test_a_loop_without_gain_margin_costs_although_it_settles(training: Training) -> None:
    found = training.measured("pid", linear(kp_1_s=100.0))[0]
    assert found.settling_error > max(step.settling_error for step in found.steps)


def test_a_fuzzy_law_that_is_linear_costs_what_the_linear_one_costs(training: Training) -> None:
    # e2 below any error: nothing but its PD part
    fuzzy = {"fine_um": 0.001, "coarse_share": 1.2, "weight_share": 1.0}
    fuzzy |= {"output_mm_s": 10.0, "fuzzy_kp_1_s": 5.0, "fuzzy_kd": 0.0}
    assert training.cost("fuzzy_pd", linear() | fuzzy) == pytest.approx(
        training.cost("pid", linear(ki_1_s2=0.0)), rel=0.02
    )


def test_every_law_gets_the_same_number_of_evaluations(training: Training) -> None:
    generations = 1
    found = {law: tuned(training, law, 5, generations, lambda _cost: None) for law in LAWS}
    assert {entry.evaluations for entry in found.values()} == {POPULATION * (generations + 1)}
    for law, entry in found.items():
        assert entry.cost == min(entry.history) == training.cost(law, entry.values)
