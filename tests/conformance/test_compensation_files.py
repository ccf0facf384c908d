"""Every compensation with a section is found, and the declarations of its file are consistent."""

import dataclasses
import math
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from kernels.quantities import Quantity, suffix_of
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.law_sections import SECTIONS
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.section import AxisFacts, Key
from servo_ctrl.control.tick import axis_tick, initial_state
from servo_ctrl.control.types import AxisSample

MACHINES = Path(__file__).parents[2] / "machines"
FACTS = AxisFacts(period_s=1e-3, acceleration_m_s2=1.0, jerk_m_s3=50.0)
FILES = ("xy_table", "precision_stage", "precision_stage/controller_cst.toml")
CONFIGS = [load_machine(MACHINES / name).axes["x"] for name in FILES]
every_part = pytest.mark.parametrize("field", SECTIONS)


def made_params(field: str) -> list[Any]:
    """What the machine files of the project make of this part."""
    section = SECTIONS[field]
    settings = [axis.section(section.settings) for axis in CONFIGS]
    return [section.params(own, FACTS) for own in settings if own is not None]


@every_part
def test_every_key_has_a_meaning(field: str) -> None:
    hints = get_type_hints(SECTIONS[field].settings, include_extras=True)
    for key in dataclasses.fields(SECTIONS[field].settings):
        (declared,) = [item for item in hints[key.name].__metadata__ if isinstance(item, Key)]
        assert declared.meaning.endswith(".")


@every_part
def test_parameters_are_plain_and_within_their_bounds_and_names_end_in_units(field: str) -> None:
    assert made_params(field)
    for params in (SECTIONS[field].neutral, *made_params(field)):
        assert type(params) is type(SECTIONS[field].neutral)
        for name, hint in get_type_hints(type(params), include_extras=True).items():
            for quantity in getattr(hint, "__metadata__", ()):
                assert isinstance(quantity, Quantity)
                assert name.endswith(suffix_of(quantity.unit))
                assert type(getattr(params, name)) in {float, int}
                assert quantity.lower <= getattr(params, name) <= quantity.upper


@every_part
def test_a_disabled_compensation_equals_its_absence(field: str) -> None:
    section = SECTIONS[field]
    base = axis_params(load_machine(MACHINES / "xy_table"), "x")
    for params in made_params(field):
        off = base._replace(**{field: params._replace(enabled=False)})
        without = base._replace(**{field: section.neutral._replace(enabled=False)})
        states = [initial_state(0.0)] * 2
        for k in range(400):
            position_m = 1e-3 * math.sin(0.02 * k)
            sample = AxisSample(
                position_command_m=position_m,
                velocity_command_m_s=0.02 * math.cos(0.02 * k),
                acceleration_command_m_s2=-0.4 * math.sin(0.02 * k),
                force_offset_n=0.0,
                motor_position_m=0.99 * position_m,
                scale_position_m=0.98 * position_m,
                motor_force_n=30.0,
            )
            (states[0], command), (states[1], other) = (
                axis_tick(p, state, sample) for p, state in zip((off, without), states, strict=True)
            )
            assert repr(command) == repr(other)
