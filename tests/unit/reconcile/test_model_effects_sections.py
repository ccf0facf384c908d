"""Sections of a model file: read as effects of the catalogue, left out, or refused."""

from pathlib import Path

import pytest
from synthetic_findings import data, model_file

from reconcile.catalogue.kinds import RegressionData
from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import ModelEffects, NominalAxis
from reconcile.nominal_model.model_effects import model_effects_of
from reconcile.nominal_model.model_file import load_model
from reconcile.nominal_model.model_terms import terms_of_model

WINDING = "[axis.x.winding]\nresistance_ohm = 2.0\ninductance_mh = 5.0\n"


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


def _held(folder: Path, extra: str) -> tuple[ModelEffects, NominalAxis]:
    file = model_file(folder, extra=extra)
    model = load_model(file)
    return model_effects_of(file, "x", model.document["axis"]), model.axes["x"]


def test_backlash_before_a_spring_is_two_effects(tmp_path: Path, seen: RegressionData) -> None:
    held, axis = _held(
        tmp_path,
        "[axis.x.backlash]\nplay_um = 3.0\n"
        "[axis.x.drive_compliance]\nstiffness_n_um = 200.0\ndamping_n_s_m = 5000.0\n",
    )
    known = {k.effect: k.coefficients for k in terms_of_model(axis._replace(model_effects=held), [seen])}
    assert known == {"backlash": pytest.approx((3e-6,)), "drive_compliance": pytest.approx((1 / 2e8,))}
    unknown_rotor = terms_of_model(axis._replace(model_effects=held), [seen._replace(motor_mass_kg=0.0)])
    assert unknown_rotor[1].coefficients == pytest.approx((1 / 2e8, 0.0))


def test_one_shape_of_several_sections_is_one_effect(tmp_path: Path, seen: RegressionData) -> None:
    """Asymmetric friction is a constant force while the axis moves; an eccentric encoder reads ahead."""
    held, axis = _held(
        tmp_path,
        "[axis.x.constant_force]\nforce_n = -6.0\n"
        "[axis.x.asymmetric_coulomb_friction]\nhalf_difference_n = 2.0\n"
        "[axis.x.lead_error_periodic]\namplitude_um = 3.0\nharmonic = 1.0\nphase_deg = 0.0\n"
        "[axis.x.encoder_eccentricity]\namplitude_um = 3.0\nphase_deg = 90.0\n",
    )
    known = {k.effect: k for k in terms_of_model(axis._replace(model_effects=held), [seen])}
    assert set(known) == {"constant_force", "lead_error_periodic"}
    assert known["constant_force"].coefficients == pytest.approx((8.0,))
    assert known["lead_error_periodic"].coefficients == pytest.approx((3e-6, -3e-6))


def test_neutral_or_uncatalogued_sections_are_left_out(tmp_path: Path, seen: RegressionData) -> None:
    held, axis = _held(
        tmp_path,
        "[axis.x.cogging]\nharmonic = [1.0]\namplitude_n = [0.0]\nphase_deg = [0.0]\n"
        "[axis.x.transport_delay]\ndelay_ms = 0.0\n"
        "[axis.x.torque_constant_saturation]\nsaturation_a = 1e9\n"
        "[axis.x.cross_axis_coupling]\nother_axis = 'y'\n"
        "[axis.x.something_of_mine]\nvalue = 1.0\n",
    )
    assert terms_of_model(axis._replace(model_effects=held), [seen]) == []


def test_axis_that_was_not_recorded_moves_no_reading(tmp_path: Path, seen: RegressionData) -> None:
    held, axis = _held(tmp_path, "[axis.x.cross_axis_coupling]\nother_axis = 'z'\nsquareness_um_m = 40.0\n")
    [known] = terms_of_model(axis._replace(model_effects=held), [seen])
    assert known.coefficients == pytest.approx((0.0, 4e-5))
    alone = seen._replace(others={"y": seen.others["y"]})
    assert terms_of_model(axis._replace(model_effects=held), [alone]) == []


def test_voltage_limit_of_a_winding_is_its_amplifiers(tmp_path: Path, seen: RegressionData) -> None:
    held, axis = _held(tmp_path, WINDING + "[axis.x.amplifier]\nvoltage_limit_v = 60.0\n")
    [known] = terms_of_model(axis._replace(model_effects=held), [seen])
    constant_n_a = axis.force_constant_n_a
    assert known.effect == "voltage_saturation"
    assert known.shape_parameters == pytest.approx((30.0 * constant_n_a, 60.0 / constant_n_a))


@pytest.mark.parametrize(
    ("section", "key", "reason"),
    [
        ("[axis.x.stribeck_friction]\nstribeck_n = 3.0\n", "stribeck_friction.stribeck_mm_s", "missing"),
        ("[axis.x.backlash]\nplay_um = -1.0\n", "backlash.play_um", "-1 is not within 0 to 10000 um"),
        ("[axis.x.backlash]\nplay_um = 'much'\n", "backlash.play_um", "must be a number"),
        ("[axis.x.backlash]\nplay_um = 1.0\nplay = 2.0\n", "backlash.play", "unknown key"),
        (
            "[axis.x.cross_axis_coupling]\nother_axis = 'x'\n",
            "cross_axis_coupling.other_axis",
            "another axis: y, z",
        ),
        (
            WINDING + "[axis.x.amplifier]\nvoltage_limit_v = 0\n",
            "amplifier.voltage_limit_v",
            "0 is not within 1 to 1e+06",
        ),
    ],
)
def test_broken_section_is_refused_by_file_and_key(
    tmp_path: Path, section: str, key: str, reason: str
) -> None:
    file = model_file(tmp_path, extra=section)
    with pytest.raises(ReconcileError) as caught:
        model_effects_of(file, "x", load_model(file).document["axis"])
    assert caught.value.file == str(file)
    assert caught.value.where == f"axis.x.{key}"
    assert reason in caught.value.reason


def test_lists_end_where_the_plants_end(tmp_path: Path, seen: RegressionData) -> None:
    held, axis = _held(
        tmp_path,
        "[axis.x.cogging]\nharmonic = [4.0, 6.0, 8.0]\namplitude_n = [2.0, 0.0, 1.0]\n"
        "phase_deg = [90.0, 0.0, 0.0]\n",
    )
    [known] = terms_of_model(axis._replace(model_effects=held), [seen])
    assert known.shape_parameters == (4.0,)
    assert known.coefficients == pytest.approx((0.0, -2.0))
