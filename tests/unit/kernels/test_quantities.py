"""Units in names and keys."""

from typing import Annotated, NamedTuple

import pytest

from hil_sim.physics.transmission import drive_compliance, thermal_expansion
from kernels.quantities import Quantity, fields_of, record_dtype, suffix_of


class NoUnit(NamedTuple):
    stiffness: Annotated[float, Quantity("N/m", 0.0, 1.0, "stiffness")]


class NoQuantity(NamedTuple):
    mass_kg: float


@pytest.mark.parametrize(
    ("unit", "suffix"),
    [("N/m", "_n_m"), ("", ""), ("um/(m K)", "_um_m_k"), ("N s/m", "_n_s_m"), ("1/s", "_1_s")],
)
def test_suffix_of_a_unit(unit: str, suffix: str) -> None:
    assert suffix_of(unit) == suffix


def test_keys_carry_the_unit_of_the_file() -> None:
    assert [f.key for f in fields_of(drive_compliance.Params)] == ["stiffness_n_um", "damping_n_s_m"]
    assert fields_of(thermal_expansion.Params)[0].key == "expansion_um_m_k"


def test_degrees_celsius_become_kelvin() -> None:
    assert Quantity("K", 200.0, 400.0, "temperature", "degC").to_si(20.0) == pytest.approx(293.15)


@pytest.mark.parametrize("params", [NoUnit, NoQuantity])
def test_a_parameter_without_unit_is_refused(params: type) -> None:
    with pytest.raises(TypeError, match=r"stiffness|mass_kg"):
        fields_of(params)


def test_record_is_c_aligned_doubles_after_the_switch() -> None:
    dtype = record_dtype(drive_compliance.Params)
    assert dtype.names == ("enabled", "stiffness_n_m", "damping_n_s_m")
    assert dtype.itemsize == 24
    assert dtype.isalignedstruct
