"""plant.toml: values read, and errors that name file, key and reason."""

import math
from pathlib import Path

import pytest
from machine_files import write_plant

from hil_sim.config import ConfigError, build_plant, load_plant
from hil_sim.plant.integrate import advance

MACHINES = Path(__file__).parents[3] / "machines"

GOOD = """
[plant]
name = "test"
substep_us = 50.0
[axis.x]
drive = { node_id = 1, eds = "drive.eds" }
scale = { node_id = 11, eds = "scale.eds", resolution_um = 0.5, reference_mark_mm = 3.0 }
encoder = { counts_per_rev = 1000000, index_mm = 1.0 }
limit_switches = { negative_mm = -50.0, positive_mm = 50.0 }
transmission = { lead_mm = 10.0 }
table = { mass_kg = 50.0, start_mm = 2.0 }
[axis.x.motor]
rated_torque_mnm = 1000
rated_current_ma = 2000
torque_constant_nm_a = 0.5
inertia_kg_cm2 = 0.5
[axis.x.amplifier]
current_bandwidth_hz = 1000
voltage_limit_v = 300
peak_current_a = 6
position_gain_1_s = 40
velocity_gain_n_s_m = 1e4
velocity_integral_n_m = 1e5
velocity_feedforward = 1
velocity_filter_hz = 500
[axis.x.drive_compliance]
stiffness_n_um = 50
damping_n_s_m = 1000
[axis.x.coulomb_friction]
coulomb_n = 20
[axis.x.presliding_gms]
share = [0.5, 0.5]
stiffness_n_um = [10, 1.0]
attraction_n_s = 1e5
micro_damping_n_s_m = 100
"""


def test_file_becomes_si_records(tmp_path: Path) -> None:
    config = load_plant(write_plant(tmp_path, GOOD))
    p = build_plant(config).params[0]
    assert p["mechanics"]["lead_m"] == pytest.approx(0.01)
    assert p["mechanics"]["motor_mass_kg"] == pytest.approx(0.5e-4 * (2.0 * math.pi / 0.01) ** 2)
    assert p["mechanics"]["force_constant_n_a"] == pytest.approx(0.5 * 2.0 * math.pi / 0.01)
    assert p["drive_compliance"]["stiffness_n_m"] == pytest.approx(50e6)
    assert list(p["presliding_gms"]["stiffness_n_m"][:3]) == pytest.approx([10e6, 1e6, 0.0])
    assert p["encoder"]["resolution_m"] == pytest.approx(10e-9)
    assert p["scale"]["reference_mark_m"] == pytest.approx(3e-3)
    assert p["winding"]["enabled"] == 0
    axis = config.axes["x"]
    assert axis.drive.eds == tmp_path / "drive.eds"


def test_plant_starts_where_it_stands_with_counters_at_zero(tmp_path: Path) -> None:
    config = load_plant(write_plant(tmp_path, GOOD))
    plant = build_plant(config)
    advance(*plant, 20, config.dt_s)
    assert plant.state["motor_position_m"][0] == pytest.approx(2e-3)
    assert plant.state["encoder_counts"][0] == 0
    assert plant.state["scale_counts"][0] == 0


@pytest.mark.parametrize(
    ("old", "new", "key", "reason"),
    [
        ("coulomb_n = 20", "coulomb_n = -1", "axis.x.coulomb_friction.coulomb_n", "not within 0 to 10000 N"),
        ("coulomb_n = 20", "coulomb_n = nan", "axis.x.coulomb_friction.coulomb_n", "must be a number"),
        ("coulomb_n = 20", 'coulomb_n = "20"', "axis.x.coulomb_friction.coulomb_n", "must be a number"),
        ("coulomb_n = 20", "coulomb_n = true", "axis.x.coulomb_friction.coulomb_n", "must be a number"),
        ("coulomb_n = 20", "coulomb = 20", "axis.x.coulomb_friction.coulomb_n", "missing"),
        ("coulomb_n = 20", "coulomb_n = 20\nx = 1", "axis.x.coulomb_friction.x", "unknown key"),
        ("[axis.x.coulomb_friction]", "[axis.x.friction]", "axis.x.friction", "unknown key"),
        ("[plant]", "[plants]\n[plant]", "plants", "unknown key"),
        ("mass_kg = 50.0", "mass_kg = 0", "axis.x.table.mass_kg", "greater than 0"),
        ("node_id = 11", "node_id = 1", "plant", "node id 1 is used twice"),
        ("node_id = 11", "node_id = 128", "axis.x.scale.node_id", "less than or equal to 127"),
        ("negative_mm = -50.0", "negative_mm = 60.0", "axis.x.limit_switches", "must be below"),
        ("share = [0.5, 0.5]", "share = [0.5, 0.6]", "axis.x.presliding_gms", "add up to 1.1"),
        ("share = [0.5, 0.5]", "share = [0, 1]", "axis.x.presliding_gms", "other values follow"),
        ("share = [0.5, 0.5]", "share = 1", "axis.x.presliding_gms.share", "list of at most 8"),
        ("inertia_kg_cm2 = 0.5", "inertia_kg_cm2 = 0.001", "axis.x.drive_compliance", "too stiff"),
        (
            "stiffness_n_um = 50",
            "stiffness_n_um = 1e9",
            "axis.x.drive_compliance.stiffness_n_um",
            "not within",
        ),
        ("inertia_kg_cm2 = 0.5", "", "axis.x.drive_compliance", "inertia_kg_cm2"),
        ("mass_kg = 50.0", "mass_kg = 0.01", "axis.x.table", "too small for a presliding"),
        (
            "current_bandwidth_hz = 1000",
            "",
            "axis.x.amplifier",
            "either current_bandwidth_hz or current_gain",
        ),
        (
            "current_bandwidth_hz = 1000",
            "current_bandwidth_hz = 1000\ncurrent_gain_v_a = 20",
            "axis.x.amplifier",
            "either current_bandwidth_hz or current_gain_v_a",
        ),
        (
            "current_bandwidth_hz = 1000",
            "current_gain_v_a = 20",
            "axis.x.amplifier.current_gain_v_a",
            "needs the section winding",
        ),
        (
            "[plant]",
            "[axis.x.structural_mode]\nmass_kg = 5\nfrequency_hz = 2000\ndamping_ratio = 1\n[plant]",
            "axis.x.structural_mode",
            "too stiff for the table",
        ),
        ("substep_us = 50.0", "substep_us = 100.0", "plant.substep_us", "less than or equal to 50"),
        ("substep_us = 50.0", "substep_us = 1e-6", "plant.substep_us", "greater than or equal to 1"),
        ("substep_us = 50.0", "substep_us = 33.3", "plant.substep_us", "whole number of substeps"),
        ("substep_us = 50.0", "drive_tick_ms = 0", "plant.drive_tick_ms", "greater than or equal to 1"),
        ("[axis.x.drive_compliance]", "[axis.x.backlash]\nplay_um = 1\n[axis.y.x]", "axis.y", "is missing"),
    ],
)
def test_error_names_file_key_and_reason(tmp_path: Path, old: str, new: str, key: str, reason: str) -> None:
    assert GOOD.count(old) == 1
    with pytest.raises(ConfigError) as caught:
        load_plant(write_plant(tmp_path, GOOD.replace(old, new)))
    assert caught.value.key.startswith(key)
    assert reason in caught.value.reason
    assert str(tmp_path / "plant.toml") in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("section", "needed"),
    [("backlash]\nplay_um = 1", "drive_compliance"), ("presliding_lugre]\nstiffness_n_um = 10", "only one")],
)
def test_effects_that_need_or_exclude_one_another(tmp_path: Path, section: str, needed: str) -> None:
    text = GOOD.replace("[axis.x.drive_compliance]\nstiffness_n_um = 50\ndamping_n_s_m = 1000\n", "")
    extra = "bristle_damping_n_s_m = 0" if "lugre" in section else ""
    with pytest.raises(ConfigError, match=needed):
        load_plant(write_plant(tmp_path, f"{text}\n[axis.x.{section}\n{extra}"))


def test_proportional_current_loop_may_not_ring_from_substep_to_substep(tmp_path: Path) -> None:
    """u is held over a substep: i' = kept i - (1 - kept) Kcp / R i, which is negative above L / h, nearly."""
    winding = "[axis.x.winding]\nresistance_ohm = 3.0\ninductance_mh = 10.0\n"
    for gain, rings in ((0.9 * 10e-3 / 50e-6, False), (1.1 * 10e-3 / 50e-6, True)):
        text = GOOD.replace("current_bandwidth_hz = 1000", f"current_gain_v_a = {gain}") + winding
        if rings:
            with pytest.raises(ConfigError, match="too high for the winding at this substep"):
                load_plant(write_plant(tmp_path, text))
        else:
            assert load_plant(write_plant(tmp_path, text)).axes["x"].amplifier.current_gain_v_a == gain


def test_missing_file_and_broken_toml_are_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file"):
        load_plant(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="not TOML"):
        load_plant(write_plant(tmp_path, "[plant"))


@pytest.mark.parametrize("machine", sorted(file.parent for file in MACHINES.rglob("plant.toml")), ids=str)
def test_every_machine_of_the_project_loads_and_runs(machine: Path) -> None:
    config = load_plant(machine)
    plant = build_plant(config)
    plant.setpoint["loop"] = 1
    plant.setpoint["current_a"] = 0.2
    advance(*plant, 2000, config.dt_s)
    assert plant.state["time_s"][0] == pytest.approx(2000 * config.dt_s)


def test_emps_is_the_published_rigid_model() -> None:
    config = load_plant(MACHINES / "emps")
    axis = config.axes["x"]
    assert axis.force_constant_n_a == pytest.approx(35.1507, rel=1e-6)
    assert axis.table.mass_kg == 95.109
    assert axis.lead_m / axis.encoder.counts_per_rev == pytest.approx(50e-9)
    assert axis.amplifier.peak_current_a * axis.force_constant_n_a == pytest.approx(351.507, rel=1e-6)
    rated_n = axis.motor.rated_torque_mnm * 1e-3 * 2.0 * math.pi / axis.lead_m
    assert 32.767 * rated_n > 351.507  # a set point of 16 bits reaches the full force
