"""Every effect's file is complete; effects are found by discovery, so a new one is tested automatically."""

import inspect
from types import ModuleType

import pytest

from hil_sim.config.load import EFFECT_PARAMS, SENSORS
from hil_sim.physics.kinds import Kind
from hil_sim.physics.registry import EFFECTS
from hil_sim.plant.layout import AXIS_PARAMS, AXIS_STATE, state_dtype
from kernels.quantities import FILE_UNITS, Quantity, fields_of, record_dtype, section_of

every_effect = pytest.mark.parametrize("effect", EFFECTS, ids=section_of)


def test_effects_are_found() -> None:
    assert len(EFFECTS) >= 15
    assert len({section_of(effect) for effect in EFFECTS}) == len(EFFECTS)


@every_effect
def test_docstring_states_law_source_symbols_validity_and_look_alikes(effect: ModuleType) -> None:
    text = effect.__doc__ or ""
    for part in ("Law:", "Source:", "Symbols:", "Valid:", "Confused with:"):
        assert part in text, part


@every_effect
def test_every_parameter_has_unit_bounds_and_meaning_and_is_in_the_symbols(effect: ModuleType) -> None:
    text = effect.__doc__ or ""
    for field in fields_of(effect.Params):
        quantity = field.quantity
        assert isinstance(quantity, Quantity)
        assert quantity.meaning
        assert quantity.lower < quantity.upper
        assert not quantity.file_unit or (quantity.unit, quantity.file_unit) in FILE_UNITS
        assert f"`{field.name}`" in text, field.name
        assert quantity.from_si(quantity.to_si(1.25)) == pytest.approx(1.25)


@every_effect
def test_effect_has_the_functions_of_its_kind(effect: ModuleType) -> None:
    assert isinstance(effect.KIND, Kind)
    role, remembers = effect.KIND.value, hasattr(effect, "State")
    for name, arguments in (*role.functions, *(role.state_functions if remembers else ())):
        signature = inspect.signature(getattr(effect, name).py_func)
        expected = [a for a in arguments.split() if a != "s" or remembers]
        assert [a.lstrip("_") for a in signature.parameters] == expected, name
    if effect.KIND in {Kind.PRESLIDING, Kind.PRESLIDING_LEVEL}:
        assert callable(effect.sticking_stiffness_n_m)
    if remembers:
        assert set(effect.State._fields) == set(effect.State._field_defaults)
        assert AXIS_STATE[section_of(effect)] == state_dtype(effect.State)


@every_effect
def test_neutral_values_lie_within_the_bounds(effect: ModuleType) -> None:
    if effect.NEUTRAL is None:
        pytest.skip("no values make this effect vanish; its file says what its absence means")
    for field in fields_of(effect.Params):
        value = getattr(effect.NEUTRAL, field.name)
        for number in value if field.quantity.length else (value,):
            assert field.quantity.lower <= number <= field.quantity.upper


@every_effect
def test_effect_is_a_section_of_the_plant_file_and_a_record_of_the_plant(effect: ModuleType) -> None:
    name = section_of(effect)
    assert AXIS_PARAMS[name] == record_dtype(effect.Params)
    assert name in SENSORS or EFFECT_PARAMS[name] is effect.Params
