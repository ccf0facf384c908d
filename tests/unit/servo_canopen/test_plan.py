"""The boot plan of the X-Y table by hand calculation, and machine files that cannot be planned."""

import math
import re
import struct
from pathlib import Path

import pytest
from machine_files import text_of, write_controller

from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.canopen.scaling import drive_scaling, to_integer
from servo_ctrl.canopen.settings import drive_settings, interpolation_period
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation.sampled_dual_loop import SampledDualLoopSettings
from servo_ctrl.errors import ConfigError


def in_mode(mode: str, text: str) -> str:
    """The machine file in another mode, without what only cst can do."""
    sections = re.sub(r"\[axis\.\w+\.disturbance_observer\][^\[]*", "", text)
    if mode == "csp":
        sections = re.sub(r"\[axis\.\w+\.(friction_compensation|fuzzy_pd)\][^\[]*", "", sections)
    return sections.replace('mode = "cst"', f'mode = "{mode}"')


def written(plan: NodePlan, index: int, subindex: int, form: str) -> int:
    data = next(w.data for w in plan.writes if (w.index, w.subindex) == (index, subindex))
    return int(struct.unpack("<" + form, data)[0])


def test_nodes_come_in_order_of_axes_with_predefined_identifiers(plans: tuple[NodePlan, ...]) -> None:
    assert [(plan.key, plan.tpdo.cob_id) for plan in plans] == [
        ("axis.x.drive", 0x181),
        ("axis.x.scale", 0x18B),
        ("axis.y.drive", 0x182),
        ("axis.y.scale", 0x18C),
    ]
    assert [plan.rpdo.cob_id for plan in plans if len(plan.pdos) > 1] == [0x201, 0x202]


def test_limits_are_in_the_drives_integers(table: MachineConfig, plans: tuple[NodePlan, ...]) -> None:
    axis = table.axes["x"]
    counts_per_mm = axis.drive.counts_per_rev / axis.transmission.lead_mm
    assert written(plans[0], 0x607D, 1, "i") == round(axis.limits.position_mm[0] * counts_per_mm)
    assert written(plans[0], 0x6085, 0, "I") == round(axis.limits.acceleration_mm_s2 * counts_per_mm)
    assert written(plans[0], 0x6065, 0, "I") == round(axis.limits.following_error_mm * counts_per_mm)
    torque_nm = axis.limits.force_n * axis.transmission.lead_mm * 1e-3 / (2.0 * math.pi)
    permille = torque_nm / (axis.drive.rated_torque_mnm * 1e-3) * 1000.0
    assert permille < written(plans[0], 0x6072, 0, "H") <= permille + 1.0


def test_force_of_one_permille_is_rated_torque_over_lead(table: MachineConfig) -> None:
    axis = table.axes["x"]
    scaling = drive_scaling(axis)
    expected = axis.drive.rated_torque_mnm * 1e-6 * 2.0 * math.pi / (axis.transmission.lead_mm * 1e-3)
    assert math.isclose(scaling.newton_per_permille, expected, rel_tol=1e-15)


@pytest.mark.parametrize(
    ("value", "integer"), [(1.3, 3), (1.25, 2), (1.75, 4), (-1.3, -3), (90.0, 50), (-90.0, -50)]
)
def test_integers_are_rounded_half_to_even_and_clamped(value: float, integer: int) -> None:
    assert to_integer(value, 0.5, -50, 50) == integer


@pytest.mark.parametrize(("value", "integer"), [(math.nan, 0), (math.inf, 50), (-math.inf, -50), (1e308, 50)])
def test_non_finite_values_raise_nothing_in_a_cycle(value: float, integer: int) -> None:
    assert to_integer(value, 0.5, -50, 50) == integer


@pytest.mark.parametrize("period_us", [100, 125, 250, 255, 500, 1000, 2000, 4000, 10_000, 100_000])
def test_interpolation_period_is_the_sync_period(period_us: int) -> None:
    value, exponent = interpolation_period(period_us)
    assert 0 < value <= 255
    assert math.isclose(value * 10.0**exponent, period_us * 1e-6, rel_tol=1e-12)


def test_limit_switches_have_a_separate_pdo(plans: tuple[NodePlan, ...]) -> None:
    switches = plans[0].switches
    assert switches is not None
    assert (switches.cob_id, switches.mapping, switches.transmission_type) == (0x281, 0x1A01, 10)
    assert [mapped.mapping_entry for mapped in switches.codec.objects] == [0x60FD_00_20]
    assert plans[1].switches is None


def test_other_pdos_of_the_drive_are_switched_off(plans: tuple[NodePlan, ...]) -> None:
    eds = plans[0].eds
    others = {
        index
        for index, sub in eds.variables
        if sub == 1 and (0x1401 <= index <= 0x1403 or 0x1802 <= index <= 0x1803)
    }
    assert {index for index, _ in plans[0].unused_pdos} == others


@pytest.mark.parametrize(
    ("text", "replacement", "complaint"),
    [
        ('"torque_offset"]', '"torque_ofset"]', 'axis.x.drive.rpdo1: .*has no object "torque_ofset"'),
        ('"torque_offset"]', '"0x6083:00"]', "axis.x.drive.rpdo1: .*profile_acceleration"),
        ('"modes_of_operation", ', "", "axis.x.drive.rpdo1: modes_of_operation is missing"),
        ("servo_drive.eds", "no_such.eds", "axis.x.drive.eds: .*no_such.eds: no such EDS file"),
        ("servo_drive.eds", "linear_scale.eds", "axis.x.drive.rpdo1: .*has no object"),
        (
            "tpdo_transmission_type = 1",
            "tpdo_transmission_type = 3",
            "axis.x.drive.tpdo_transmission_type: must be 1",
        ),
        ("rated_torque_mnm = 640", "rated_torque_mnm = 1", "axis.x.limits.force_n: is .* per mille"),
        ("-100.0, 100.0", "-100.0, 1.0e5", "axis.x.limits.position_mm: is more than 32-bit counts"),
    ],
)
def test_impossible_setting_names_file_and_key(
    table: MachineConfig, tmp_path: Path, text: str, replacement: str, complaint: str
) -> None:
    path = write_controller(tmp_path, text_of(table.source, {text: replacement}, occurrences=1))
    with pytest.raises(ConfigError, match=complaint) as caught:
        plan_machine(load_machine(path))
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("mode", "setpoint", "key"),
    [
        ("csv", "target_velocity", "acceleration_feedforward_kg"),
        ("csp", "target_position", "acceleration_feedforward_kg"),
        ("csp", "target_position", "velocity_feedforward"),
    ],
)
def test_feedforward_that_would_not_be_sent_is_refused(
    table: MachineConfig, tmp_path: Path, mode: str, setpoint: str, key: str
) -> None:
    text = in_mode(mode, text_of(table.source, {'"target_torque", "torque_offset"': f'"{setpoint}"'}))
    for other in ("velocity_feedforward", "acceleration_feedforward_kg"):
        text = text.replace(f"{other} = ", f"{other} = {1.0 if other == key else 0.0} # ")
    path = tmp_path / "controller.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=rf"axis\.x\.control\.{key}: mode {mode} needs "):
        plan_machine(load_machine(path))
    path.write_text(text.replace(f"{key} = 1.0", f"{key} = 0.0"), encoding="utf-8")
    plan_machine(load_machine(path))


def test_acceleration_feedforward_has_room_where_the_mode_is_not_cyclic(
    table: MachineConfig, tmp_path: Path
) -> None:
    changes = {
        "homing_method = 37": "homing_method = 0",
        '"modes_of_operation", "target_torque"': '"target_velocity"',
    }
    path = write_controller(tmp_path, in_mode("csv", text_of(table.source, changes)))
    assert plan_machine(load_machine(path))[0].rpdo.codec.size == 8


def test_speed_that_no_velocity_set_point_can_hold_is_refused(table: MachineConfig) -> None:
    axis = table.axes["x"]
    limits = axis.limits.model_copy(update={"velocity_mm_s": 21_000.0})  # 2.2e9 counts/s
    fast = axis.model_copy(update={"limits": limits, "mode": "csv"})
    with pytest.raises(ConfigError, match=r"limits\.velocity_mm_s: is more than 32 bits of counts/s"):
        list(drive_settings(table, "axis.x", fast))


def test_the_drive_lets_the_motor_go_as_far_beside_the_command_as_corrections_may_lead_it() -> None:
    stage = load_machine("machines/precision_stage")
    axis = stage.axes["x"]
    assert axis.section(SampledDualLoopSettings) is not None
    beyond_mm = axis.limits.following_error_mm + axis.section(SampledDualLoopSettings).limit_um * 1e-3
    limits = {sub: value for index, sub, value, _ in drive_settings(stage, "axis.x", axis) if index == 0x607D}
    counts_per_mm = axis.drive.counts_per_rev / axis.transmission.lead_mm
    lowest_mm, highest_mm = axis.limits.position_mm
    assert limits[1] == round((lowest_mm - beyond_mm) * counts_per_mm)
    assert limits[2] == round((highest_mm + beyond_mm) * counts_per_mm)
