"""Sections of the catalogue's effects: units of the file, requirements, exclusions, names of axes."""

import math
from pathlib import Path

import pytest
from machine_files import plant_with

from hil_sim.config import ConfigError, load_plant

ON_XY = """
[axis.x.current_loop_lag]
time_ms = 1.5
[axis.x.transport_delay]
delay_ms = 0.75
[axis.x.scale_cyclic_error]
amplitude_um = 0.2
period_um = 20.0
phase_deg = 90.0
[axis.x.quadratic_viscous_friction]
quadratic_n_s2_m2 = 120.0
[axis.x.position_dependent_friction]
centre_mm = 10.0
half_travel_mm = 100.0
power_2_n = 3.0
[axis.x.presliding_hysteresis]
level_n = 4.0
way_um = 8.0
[axis.x.position_dependent_force]
centre_mm = 0.0
half_travel_mm = 100.0
power_1_n = -5.0
[axis.y.cross_axis_coupling]
other_axis = "x"
squareness_um_m = 50.0
bow_um_m2 = 20.0
"""


def test_sections_become_si_and_what_is_absent_is_none(tmp_path: Path) -> None:
    axes = load_plant(plant_with(tmp_path, ON_XY)).axes
    x, y = axes["x"].effects, axes["y"].effects
    assert x["current_loop_lag"].time_s == pytest.approx(1.5e-3)
    assert x["transport_delay"].delay_s == pytest.approx(0.75e-3)
    assert x["scale_cyclic_error"] == pytest.approx((0.2e-6, 20e-6, 0.5 * math.pi))
    assert x["quadratic_viscous_friction"].quadratic_n_s2_m2 == 120.0
    assert x["position_dependent_friction"][:5] == pytest.approx((0.01, 0.1, 0.0, 3.0, 0.0))
    assert x["presliding_hysteresis"] == pytest.approx((4.0, 8e-6))
    assert y["cross_axis_coupling"] == pytest.approx((0.0, 50e-6, 20e-6))


@pytest.mark.parametrize(
    ("old", "new", "key", "reason"),
    [
        ('other_axis = "x"', 'other_axis = "y"', "y.cross_axis_coupling.other_axis", "another axis: x"),
        ('other_axis = "x"', 'other_axis = "z"', "y.cross_axis_coupling.other_axis", "another axis: x"),
        ('other_axis = "x"', "other_axis = 0", "y.cross_axis_coupling.other_axis", "another axis: x"),
        ('other_axis = "x"', "", "y.cross_axis_coupling.other_axis", "missing"),
        ("delay_ms = 0.75", "delay_ms = 25.65", "x.transport_delay.delay_ms", "more than 512 substeps"),
        ("delay_ms = 0.75", "delay_ms = 51", "x.transport_delay.delay_ms", "not within 0 to 50 ms"),
        ("way_um = 8.0", "way_um = 0", "x.presliding_hysteresis.way_um", "not within 0.1 to 10000 um"),
        (
            "level_n = 4.0\nway_um = 8.0",
            "level_n = 1e4\nway_um = 0.1",
            "x.table",
            "too small for a presliding stiffness",
        ),
        (
            "half_travel_mm = 100.0\npower_1_n = -5.0",
            "half_travel_mm = 1e-3\npower_3_n = -1e4",
            "x.posi",
            "steep",
        ),
        (
            "[axis.y",
            "[axis.x.voltage_saturation]\nvoltage_limit_v = 300\nresistance_ohm = 3\n[axis.y",
            "x.voltage_saturation",
            "winding has the amplifier's voltage_limit_v",
        ),
        (
            "[axis.y",
            "[axis.x.torque_ripple]\nharmonic = [1, 2]\namplitude = [0, 0.1]\nphase_deg = [0, 0]\n[axis.y",
            "x.torque_ripple",
            "amplitude ends at its first zero",
        ),
    ],
)
def test_error_names_key_and_reason(tmp_path: Path, old: str, new: str, key: str, reason: str) -> None:
    assert ON_XY.count(old) == 1
    with pytest.raises(ConfigError) as caught:
        load_plant(plant_with(tmp_path, ON_XY.replace(old, new)))
    assert caught.value.key.startswith(f"axis.{key}")
    assert reason in caught.value.reason


@pytest.mark.parametrize(
    ("section", "needed"),
    [
        ("asymmetric_coulomb_friction]\nhalf_difference_n = 1.0", "coulomb_friction"),
        ("position_dependent_friction]\ncentre_mm = 0\nhalf_travel_mm = 9", "coulomb_friction"),
        ("dwell_dependent_breakaway]\ngrowth_n = 1\ntime_s = 1\nway_um = 9", "coulomb_friction"),
        ("asymmetric_viscous_friction]\nhalf_difference_n_s_m = 1.0", "viscous_friction"),
        ("scale_cyclic_error]\namplitude_um = 1\nperiod_um = 9\nphase_deg = 0", "scale"),
    ],
)
def test_what_an_effect_needs_must_be_there(tmp_path: Path, section: str, needed: str) -> None:
    file = plant_with(tmp_path, f"\n[axis.x.{section}\n", "emps")
    text = file.read_text(encoding="utf-8")
    for present in (
        "[axis.x.coulomb_friction]\ncoulomb_n = 20.394\n",
        "[axis.x.viscous_friction]\nviscous_n_s_m = 203.5\n",
    ):
        text = text.replace(present, "")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=f"needs the section {needed}"):
        load_plant(file)


def test_a_lonely_axis_has_none_to_follow(tmp_path: Path) -> None:
    file = plant_with(tmp_path, '\n[axis.x.cross_axis_coupling]\nother_axis = "x"\n', "precision_stage")
    with pytest.raises(ConfigError, match="another axis: there is none"):
        load_plant(file)
