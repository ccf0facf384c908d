"""Identified values outside the plant's bounds are clamped or left out, with a note."""

from pathlib import Path

import pytest
from synthetic_findings import BASE, FORCE, FORCE_CONSTANT_N_A, POSITION_DEVIATION, data, updated_axis

from reconcile.catalogue.kinds import RegressionData, ResidualChannel


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> RegressionData:
    return data(tmp_path_factory.mktemp("nominal"))


def test_presliding_takes_its_share_of_the_friction_and_no_more(tmp_path: Path, seen: RegressionData) -> None:
    axis, notes = updated_axis(
        tmp_path, "presliding_hysteresis", FORCE, [{"level_n": 5.0, "way_m": 8e-6}], seen
    )
    assert axis.effects["coulomb_friction"].coulomb_n == pytest.approx(BASE["coulomb_n"] - 5.0)
    assert not notes
    axis, [note] = updated_axis(
        tmp_path, "presliding_hysteresis", FORCE, [{"level_n": 13.0, "way_m": 8e-6}], seen
    )
    assert axis.effects["coulomb_friction"].coulomb_n == 0.0
    assert axis.effects["presliding_hysteresis"].level_n == BASE["coulomb_n"]
    assert "found to be 13; it is held to the Coulomb friction, 12 N" in note


def test_presliding_of_any_curve_is_written_as_it_was_found(tmp_path: Path, seen: RegressionData) -> None:
    """Several distances and exponents, each an element; so many as the plant takes, the highest first."""
    ways = [
        {"level_n": 3.0, "way_m": 8e-6, "exponent": 0.5},
        {"level_n": 5.0, "way_m": 3e-5, "exponent": 0.0},
    ]
    axis, notes = updated_axis(tmp_path, "presliding_hysteresis", FORCE, ways, seen)
    assert not notes
    assert "presliding_hysteresis" not in axis.effects
    elements = axis.effects["presliding_elements"]
    assert elements.level_n == pytest.approx(8.0)
    assert elements.share[:3] == pytest.approx((0.625, 0.375, 0.0))
    assert elements.way_m[:2] == pytest.approx((3e-5, 8e-6))
    assert elements.exponent[:2] == (0.0, 0.5)
    assert axis.effects["coulomb_friction"].coulomb_n == pytest.approx(BASE["coulomb_n"] - 8.0)
    many = [{"level_n": 1.0 + 0.01 * k, "way_m": 1e-6 * k, "exponent": 0.0} for k in range(1, 10)]
    axis, [note] = updated_axis(tmp_path, "presliding_hysteresis", FORCE, many, seen)
    assert "1.01 N over 1 um is left out, the plant takes 8 elements" in note


@pytest.mark.parametrize(
    ("effect", "channel", "found", "reason"),
    [
        ("presliding_hysteresis", FORCE, {"level_n": -2.0, "way_m": 8e-6}, "level_n was found to be -2"),
        ("backlash", POSITION_DEVIATION, {"play_m": -1e-6}, "play_m was found to be -1e-06"),
        (
            "drive_compliance",
            POSITION_DEVIATION,
            {"stiffness_n_m": -1e8},
            "stiffness_n_m was found to be -1e+08",
        ),
        (
            "torque_constant_saturation",
            FORCE,
            {"loss_at_peak": -0.1, "peak_n": 9.0},
            "more force comes of a high current",
        ),
        ("cross_axis_coupling", FORCE, {"coefficient_1": 2.0}, "no force goes from axis to axis"),
        ("unknown", FORCE, {"size_n": 2.0}, "it is in no catalogue"),
    ],
)
def test_values_impossible_in_a_plant_are_noted_and_left_out(
    tmp_path: Path,
    seen: RegressionData,
    effect: str,
    channel: ResidualChannel,
    found: dict[str, float],
    reason: str,
) -> None:
    axis, [note] = updated_axis(tmp_path, effect, channel, [found], seen)
    assert effect not in axis.effects
    assert note.startswith(f"model.toml, axis x: {effect} is not in the model: ")
    assert reason in note


def test_values_beyond_the_bounds_are_clamped_and_noted(tmp_path: Path, seen: RegressionData) -> None:
    axis, [note] = updated_axis(
        tmp_path, "lead_error_cumulative", POSITION_DEVIATION, [{"relative_error": 0.02}], seen
    )
    assert axis.effects["lead_error_cumulative"].relative_error == 0.01
    assert "lead_error_cumulative.relative_error was found to be 0.02; 0.01 is what it can be" in note
    dip = {"stribeck_n": -15.0, "stribeck_m_s": 3e-3}
    axis, [note] = updated_axis(tmp_path, "stribeck_friction", FORCE, [dip], seen)
    assert axis.effects["stribeck_friction"].stribeck_n == -BASE["coulomb_n"]
    assert "friction at rest cannot be below 0" in note
    stiff = [{"stiffness_n_m": 9e8}]
    axis, [note] = updated_axis(
        tmp_path, "drive_compliance", POSITION_DEVIATION, stiff, seen, inertia_kg_cm2=0.01
    )
    assert axis.effects["drive_compliance"].stiffness_n_m < 9e8
    assert "too stiff for the substep of 50 us" in note


def test_voltage_limit_of_a_motor_with_a_winding_is_its_amplifiers(
    tmp_path: Path, seen: RegressionData
) -> None:
    winding = "[axis.x.winding]\nresistance_ohm = 2.0\ninductance_mh = 5.0\n"
    found = {"stall_n": 900.0, "free_m_s": 60.0 / FORCE_CONSTANT_N_A, "missing": 1.0}
    axis, _ = updated_axis(tmp_path, "voltage_saturation", FORCE, [found], seen, extra=winding)
    assert "voltage_saturation" not in axis.effects
    assert axis.amplifier.voltage_limit_v == pytest.approx(60.0)


def test_payload_is_a_part_of_the_fitted_mass(tmp_path: Path, seen: RegressionData) -> None:
    axis, _ = updated_axis(tmp_path, "payload_mass", FORCE, [{"mass_kg": 8.0}], seen)
    assert axis.table.mass_kg + 8.0 + axis.motor_mass_kg == pytest.approx(BASE["mass_kg"])
