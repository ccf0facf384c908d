"""A payload: more mass, and friction as it was."""

from pathlib import Path

import numpy as np
import pytest
from concealed_machine import write_machine

from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.identification.parameter_estimates import Estimate
from reconcile.identification.payload import payload
from reconcile.nominal_model.model_file import load_model

GAIN = 0.5


@pytest.fixture
def axis(tmp_path: Path) -> NominalAxis:
    return load_model(write_machine(tmp_path, {"x": ""}, np.zeros((10, 1)))).axes["x"]


def fitted(axis: NominalAxis, mass: float, friction: float, *, spread: float = 0.002) -> dict[str, Estimate]:
    """Times the nominal values, each with an interval of so large a share to either side."""
    values = baseline_parameters(axis)
    factors = {"mass_kg": mass, "viscous_n_s_m": friction, "coulomb_n": friction}
    return {
        name: Estimate(k * values[name], (k - spread) * values[name], (k + spread) * values[name], "")
        for name, k in factors.items()
    }


def test_a_wrong_mass_alone_is_a_payload(axis: NominalAxis) -> None:
    found = payload(fitted(axis, 1.1, 1.0), axis, GAIN, 0.4, bias_kg=0.0)
    assert found is not None
    nominal_kg = baseline_parameters(axis)["mass_kg"]
    added = found.parameters["mass_kg"]
    assert (added.value, added.low, added.high) == pytest.approx(
        (0.1 * nominal_kg, 0.098 * nominal_kg, 0.102 * nominal_kg)
    )
    assert (found.effect, found.channel, found.gain, found.heldout_gain) == (
        "payload_mass",
        "force",
        GAIN,
        0.4,
    )


@pytest.mark.parametrize(
    ("mass", "friction", "spread", "gain"),
    [
        (1.1, 1.1, 0.002, GAIN),  # a force constant that is off by 10 %
        (0.9, 1.0, 0.002, GAIN),  # less mass is not a payload
        (1.039, 1.0, 0.002, GAIN),  # below the least share
        (1.1, 1.0, 0.09, GAIN),  # an interval that almost reaches the nominal mass
        (1.1, 1.0, 0.002, 0.09),  # it does not matter to the force
    ],
)
def test_other_differences_are_no_payload(
    axis: NominalAxis, mass: float, friction: float, spread: float, gain: float
) -> None:
    assert payload(fitted(axis, mass, friction, spread=spread), axis, gain, 0.4, bias_kg=0.0) is None


def test_friction_may_differ_by_a_share_of_the_mass_difference(axis: NominalAxis) -> None:
    assert payload(fitted(axis, 1.1, 1.039), axis, GAIN, 0.4, bias_kg=0.0) is not None
    assert payload(fitted(axis, 1.1, 1.041), axis, GAIN, 0.4, bias_kg=0.0) is None


def test_a_mass_whose_force_is_less_than_what_nothing_explains_is_no_payload(axis: NominalAxis) -> None:
    values = fitted(axis, 1.1, 1.0)
    added_kg = 0.1 * baseline_parameters(axis)["mass_kg"]
    assert payload(values, axis, GAIN, 0.4, bias_kg=0.99 * added_kg) is not None
    assert payload(values, axis, GAIN, 0.4, bias_kg=1.01 * added_kg) is None
