"""The X-Y table as it stands against the published figures, and the search's own parts."""

import math

import pytest

from hil_sim.config import load_plant
from servo_ctrl.config.load import load_machine
from servo_ctrl.metrology.circles import ReversalFigures
from studies.feng_2015.calibration import (
    AXIS,
    FREE_PARAMETERS,
    LAG_LIMIT_M,
    LATEST_PEAK,
    MACHINE,
    RIPPLE_LIMIT_M,
    Measured,
    circle_program,
    measured,
    misfit,
    table,
    with_values,
)
from studies.feng_2015.published import FENG_2015_X_UNCOMPENSATED, relative_errors_percent


@pytest.fixture(scope="module")
def found() -> Measured:
    machine = load_machine(MACHINE)
    return measured(machine, load_plant(MACHINE), circle_program(machine))


def test_sixteen_published_figures_are_reproduced(found: Measured) -> None:
    errors = [error for row in relative_errors_percent(found.figures).values() for error in row]
    assert len(errors) == 16
    assert math.sqrt(sum(error**2 for error in errors) / 16) <= 15.0
    assert max(map(abs, errors)) <= 30.0


def test_the_published_figures_need_a_quiet_loop_and_the_peak_inside_the_window(found: Measured) -> None:
    assert found.ripple_m < RIPPLE_LIMIT_M
    assert found.latest_peak < LATEST_PEAK


def test_the_error_before_a_reversal_is_negligible_so_friction_causes_it(found: Measured) -> None:
    assert found.lag_m < LAG_LIMIT_M


def test_misfit_is_zero_for_the_published_figures_and_counts_the_largest_error() -> None:
    perfect = Measured(FENG_2015_X_UNCOMPENSATED, 0.0, 0.0, 0.5)
    assert misfit(perfect) == 0.0
    doubled = {
        feed: ReversalFigures(*(2.0 * value for value in row))
        for feed, row in FENG_2015_X_UNCOMPENSATED.items()
    }
    assert misfit(perfect._replace(figures=doubled)) == pytest.approx(1.15 * math.log(2.0))
    assert misfit(perfect._replace(ripple_m=2.0 * RIPPLE_LIMIT_M)) > 0.2
    assert misfit(perfect._replace(lag_m=2.0 * LAG_LIMIT_M)) > 0.2


def test_free_values_reach_plant_and_controller() -> None:
    values = {free.name: math.sqrt(free.lower * free.upper) for free in FREE_PARAMETERS}
    machine, plant = with_values(load_machine(MACHINE), load_plant(MACHINE), values)
    axis, control = plant.axes[AXIS], machine.axes[AXIS].control
    moved_kg = axis.table.mass_kg + axis.motor_mass_kg
    assert axis.table.mass_kg == values["table_kg"]
    assert axis.effects["coulomb_friction"].coulomb_n == values["coulomb_n"]
    assert sum(axis.effects["presliding_gms"].share) == pytest.approx(1.0)
    assert control.kv_n_s_m == pytest.approx(values["velocity_bandwidth_1_s"] * moved_kg)
    assert machine.monitoring.window_s == values["window_s"]
    assert load_plant(MACHINE).axes["y"] == plant.axes["y"]


def test_table_shows_every_feed_and_both_norms() -> None:
    text = table(FENG_2015_X_UNCOMPENSATED)
    assert all(str(feed) in text for feed in FENG_2015_X_UNCOMPENSATED)
    assert "RMS 0.0 %, largest 0.0 %" in text
