"""Pulse, observer, monitoring and learning in controller.toml: refused values, and their values in SI."""

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from machine_files import XY_TABLE, text_of, write_controller

from servo_ctrl.config.kernel_params import axis_params, with_observer, with_pulse
from servo_ctrl.config.load import load_machine
from servo_ctrl.errors import ConfigError

Make = Callable[..., Path]

PULSE = "[axis.x.friction_compensation]\nrise_ms = 8.0\nacceleration_allowed_mm_s2 = 250.0\n"
OBSERVER = "[axis.x.disturbance_observer]\nenabled = true\nbandwidth_hz = 5.0\nmass_kg = 60.0\n"
MONITORING = "[monitoring]\nwindow_s = 0.15\nrequired_um = 3.0\n"
LEARNING = """[learning]
learner = "paper"
radius_mm = 40.0
accelerations_mm_s2 = [2.0, 10.0, 20.0, 110.0]
steps = [3, 4, 5]
coarse_steps = 9
fine_steps = 8
initial_share = 0.15
duration_step_ms = 4.0
duration_reach = 1.5
window_durations = 2.5
trailing = false
"""
SECTION = re.compile(
    r"^\[(axis\.\w+\.(friction_compensation|disturbance_observer|learned_waveform|fuzzy_pd)|monitoring|learning)\]\n"
    r"(?:[^\[\n].*\n)*\n?",
    re.MULTILINE,
)


@pytest.fixture
def made(tmp_path: Path) -> Make:
    """The X-Y table with these sections in place of its own, and a text of its file replaced."""

    def make(*sections: str, **replaced: str) -> Path:
        text = SECTION.sub("", text_of(XY_TABLE / "controller.toml", replaced))
        return write_controller(tmp_path, "\n".join((text, *sections)))

    return make


@pytest.mark.parametrize(
    ("section", "text", "replacement", "key", "reason"),
    [
        (PULSE, "rise_ms = 8.0", "rise_ms = 0", "axis.x.friction_compensation.rise_ms", "greater than 0"),
        (PULSE, "= 250.0", "= -1.0", "axis.x.friction_compensation.acceleration_allowed_mm_s2", "than 0"),
        (PULSE, "= 250.0", "= inf", "axis.x.friction_compensation.acceleration_allowed_mm_s2", "finite"),
        (PULSE, "rise_ms", "fall_ms", "axis.x.friction_compensation.fall_ms", "unknown key"),
        (OBSERVER, "= 5.0", "= 0.0", "axis.x.disturbance_observer.bandwidth_hz", "greater than 0"),
        (OBSERVER, "mass_kg = 60.0", "", "axis.x.disturbance_observer.mass_kg", "is missing"),
        (OBSERVER, "= 60.0", "= 0.0", "axis.x.disturbance_observer.mass_kg", "greater than 0"),
        (OBSERVER, "= true", "= 2", "axis.x.disturbance_observer.enabled", "true or false"),
        (
            OBSERVER,
            "mass_kg",
            "viscous_n_s_m = -1.0\nmass_kg",
            "axis.x.disturbance_observer.viscous_n_s_m",
            "0",
        ),
        (MONITORING, "= 0.15", "= 0", "monitoring.window_s", "greater than 0"),
        (MONITORING, "= 3.0", "= 0.0", "monitoring.required_um", "greater than 0"),
        (
            MONITORING,
            "window_s",
            "due_after_reversals = 0\nwindow_s",
            "monitoring.due_after_reversals",
            "to 1",
        ),
        (
            MONITORING,
            "window_s",
            "due_after_reversals = 1.5\nwindow_s",
            "monitoring.due_after_reversals",
            "int",
        ),
        (
            MONITORING,
            "window_s",
            "settled_below = 0.0\nwindow_s",
            "monitoring.settled_below",
            "greater than 0",
        ),
        (MONITORING, "window_s", "settled_below = 1.1\nwindow_s", "monitoring.settled_below", "equal to 1"),
        (LEARNING, '"paper"', '"slow"', "learning.learner", "'fast' or 'paper'"),
        (LEARNING, "= 40.0", "= 0.0", "learning.radius_mm", "greater than 0"),
        (LEARNING, "2.0, 10.0", "10.0, 10.0", "learning.accelerations_mm_s2", "must rise"),
        (LEARNING, "2.0, 10.0", "10.0, 2.0", "learning.accelerations_mm_s2", "must rise"),
        (LEARNING, "2.0, 10.0", "10.0", "learning.accelerations_mm_s2", "at least 4 items"),
        (LEARNING, "2.0, 10.0", "0.0, 10.0", "learning.accelerations_mm_s2[1]", "greater than 0"),
        (LEARNING, "[3, 4, 5]", "[3, 4]", "learning.steps", "at least 3 items"),
        (LEARNING, "[3, 4, 5]", "[3, 0, 5]", "learning.steps[2]", "greater than or equal to 1"),
        (LEARNING, "[3, 4, 5]", "[3, 201, 5]", "learning.steps[2]", "less than or equal to 200"),
        (LEARNING, "coarse_steps = 9", "coarse_steps = 201", "learning.coarse_steps", "equal to 200"),
        (LEARNING, "fine_steps = 8", "fine_steps = 8.0", "learning.fine_steps", "integer"),
        (LEARNING, "= 0.15", "= 0.005", "learning.initial_share", "equal to 0.01"),
        (LEARNING, "= 0.15", "= 0.6", "learning.initial_share", "equal to 0.5"),
        (LEARNING, "step_ms = 4.0", "step_ms = 0.0", "learning.duration_step_ms", "greater than 0"),
        (LEARNING, "= 1.5", "= 1.0", "learning.duration_reach", "greater than 1"),
        (LEARNING, "= 1.5", "= 5.1", "learning.duration_reach", "equal to 5"),
        (LEARNING, "= 2.5", "= 0.9", "learning.window_durations", "equal to 1"),
        (LEARNING, "= 2.5", "= 20.1", "learning.window_durations", "equal to 20"),
        (LEARNING, "trailing = false", "rests_s = [3.0, 0.3]", "learning.rests_s", "must rise"),
        (LEARNING, "trailing = false", "rests_s = [0.0]", "learning.rests_s[1]", "greater than 0"),
        (LEARNING, "trailing = false", "rests_s = [301.0]", "learning.rests_s[1]", "equal to 300"),
        (LEARNING, "trailing = false", "adaptation = 2", "learning.adaptation", "true or false"),
    ],
)
def test_a_value_out_of_bounds_is_named(
    made: Make, section: str, text: str, replacement: str, key: str, reason: str
) -> None:
    load_machine(made(section))
    assert text in section
    with pytest.raises(ConfigError) as caught:
        load_machine(made(section.replace(text, replacement, 1)))
    assert caught.value.key == key
    assert reason in caught.value.reason
    assert "\n" not in str(caught.value)


def test_an_observer_without_the_current_is_refused(made: Make) -> None:
    path = made(OBSERVER, **{', "current_actual_value"': ""})
    with pytest.raises(ConfigError, match=r'drive\.tpdo1: "current_actual_value" is missing; the dist'):
        load_machine(path)
    load_machine(made(OBSERVER, **{'"current_actual_value"': '"0x6078:00"'}))
    load_machine(made(**{', "current_actual_value"': ""}))


@pytest.mark.parametrize(
    ("section", "mode", "reason"),
    [
        (PULSE, "csp", "friction_compensation: mode csp has no velocity set point of the controller"),
        (OBSERVER, "csv", "disturbance_observer: only mode cst has a force set point"),
        (OBSERVER, "csp", "disturbance_observer: only mode cst has a force set point"),
    ],
)
def test_a_mode_without_the_set_point_is_refused(made: Make, section: str, mode: str, reason: str) -> None:
    setpoint = {"csv": '"target_velocity"', "csp": '"target_position"'}[mode]
    others = {
        'mode = "cst"': f'mode = "{mode}"',
        '"target_torque", "torque_offset"': setpoint,
        "acceleration_feedforward_kg = ": "acceleration_feedforward_kg = 0.0 # ",
        "\nvelocity_feedforward = ": "\nvelocity_feedforward = 0.0 # ",
    }
    load_machine(made(**others))
    with pytest.raises(ConfigError, match=re.escape(reason)):
        load_machine(made(section, **others))


def test_a_velocity_set_point_takes_a_pulse(made: Make) -> None:
    csv = {
        'mode = "cst"': 'mode = "csv"',
        '"target_torque", "torque_offset"': '"target_velocity"',
        "acceleration_feedforward_kg = ": "acceleration_feedforward_kg = 0.0 # ",
    }
    assert axis_params(load_machine(made(PULSE, **csv)), "x").pulse.rise_s == pytest.approx(8e-3)


def test_pulse_and_observer_freeze_to_si(made: Make) -> None:
    params = axis_params(load_machine(made(PULSE, OBSERVER + "viscous_n_s_m = 39.0\n")), "x")
    assert params.pulse.rise_s == pytest.approx(8e-3)
    assert params.pulse.amplitude_max_m_s == pytest.approx(2e-3)  # 0.25 m/s^2 times 8 ms
    assert params.observer[:3] == (True, 60.0, 39.0)
    assert params.observer.filter_blend == pytest.approx(1.0 - math.exp(-2.0 * math.pi * 5.0 * 1e-3))


def test_an_axis_without_the_sections_has_neither_pulse_nor_observer(made: Make) -> None:
    params = axis_params(load_machine(made()), "x")
    assert not params.pulse.enabled
    assert not params.observer.enabled


def test_a_machine_file_contains_no_learned_values(made: Make) -> None:
    params = axis_params(load_machine(made(PULSE)), "x")
    assert not params.pulse.enabled
    learned = np.asfortranarray(np.arange(12).reshape(6, 2))
    put_in = with_pulse(params, learned).pulse
    assert put_in.enabled
    assert put_in.learned.flags.c_contiguous
    assert put_in.learned.dtype == np.float64
    np.testing.assert_array_equal(put_in.learned, learned)
    assert not with_pulse(params, None).pulse.enabled


def test_the_observer_is_switched_without_touching_its_model(made: Make) -> None:
    params = axis_params(load_machine(made(OBSERVER)), "x")
    off = with_observer(params, enabled=False)
    assert off.observer == params.observer._replace(enabled=False)
    assert with_observer(off, enabled=True) == params
