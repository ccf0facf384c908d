"""controller.toml: values are SI and of one type; errors name file and key."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from servo_ctrl.config.kernel_params import axis_params, motion_limits
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.section import filter_blend
from servo_ctrl.control.types import Output
from servo_ctrl.errors import ConfigError, ServoCtrlError

Spoilt = Callable[[str, str], Path]


@pytest.mark.parametrize(
    ("text", "replacement", "key", "reason"),
    [
        ('name = "xy_table"', "", "machine.name", "is missing"),
        ('name = "xy_table"', 'name = ""', "machine.name", "at least 1 character"),
        ("[bus]", "[bus]\nbaud = 1", "bus.baud", "unknown key"),
        ("[bus]", "[network]\n[bus]", "network", "unknown key"),
        ("sync_period_us = 1000", "sync_period_us = 0", "bus.sync_period_us", "greater than or equal to 100"),
        ("sync_period_us = 1000", "sync_period_us = 1e3", "bus.sync_period_us", "integer"),
        ("input_timeout_ms = 2000", "input_timeout_ms = 0", "bus.input_timeout_ms", "greater than 0"),
        ("node_id = 127", "node_id = 128", "controller.node_id", "less than or equal to 127"),
        ("node_id = 127", "node_id = 0", "controller.node_id", "greater than or equal to 1"),
        ("node_id = 127", "node_id = 1", "axis.x.drive.node_id", "already taken by controller.node_id"),
        ("node_id = 11", "node_id = 2", "axis.y.drive.node_id", "taken by axis.x.scale.node_id"),
        ('mode = "cst"', 'mode = "pp"', "axis.x.mode", "'cst', 'csv' or 'csp'"),
        ('mode = "cst"', 'mode = "csv"', "axis.x.drive.rpdo1", '"target_velocity" is missing'),
        ("homing_method = 37", "homing_method = 999", "axis.x.homing_method", "less than or equal to 127"),
        ("counts_per_rev = 1048576", "counts_per_rev = 0", "axis.x.drive.counts_per_rev", "greater than"),
        ("counts_per_rev = 1048576", 'counts_per_rev = "many"', "axis.x.drive.counts_per_rev", "integer"),
        ("rated_torque_mnm = 640", "rated_torque_mnm = -1", "axis.x.drive.rated_torque_mnm", "greater than"),
        ("rated_current_ma = 1500", "rated_current_ma = 0", "axis.x.drive.rated_current_ma", "greater than"),
        ("nm_a = 0.43", "nm_a = nan", "axis.x.drive.torque_constant_nm_a", ""),
        ("type = 1", "type = 241", "axis.x.drive.rpdo_transmission_type", "0-240, 254 or 255"),
        ('"controlword", ', "", "axis.x.drive.rpdo1", '"controlword" is missing'),
        ('tpdo1 = ["statusword", ', 'tpdo1 = ["status word", ', "axis.x.drive.tpdo1[1]", "pattern"),
        ('tpdo1 = ["position_value"]', "tpdo1 = []", "axis.x.scale.tpdo1", "at least 1 item"),
        ("resolution_um = 0.1", "resolution_um = 0.0", "axis.x.scale.resolution_um", "greater than 0"),
        ("lead_mm = 10.0", "lead_mm = inf", "axis.x.transmission.lead_mm", "finite"),
        ("[-100.0, 100.0]", "[100.0, -100.0]", "axis.x.limits.position_mm", "must be below"),
        ("[-100.0, 100.0]", "[100.0]", "axis.x.limits.position_mm", "at least 2 items"),
        ("force_n = 600.0", "force_n = 0", "axis.x.limits.force_n", "greater than 0"),
        ("kp_1_s = 40.0", "kp_1_s = -40.0", "axis.x.control.kp_1_s", "greater than or equal to 0"),
        ("kp_1_s = 40.0", "kp_1_s = true", "axis.x.control.kp_1_s", "number"),
        ("window_samples = 1", "window_samples = 3", "axis.x.control.velocity_window_samples", "less than"),
        ("window_s = 0.2", "window_s = 0", "monitoring.window_s", "greater than 0"),
        ("[machine]", 'source = "here"\n[machine]', "source", "unknown key"),
        ("[machine]", 'source_sha256 = "0"\n[machine]', "source_sha256", "unknown key"),
    ],
)
def test_an_error_names_its_key(spoilt: Spoilt, text: str, replacement: str, key: str, reason: str) -> None:
    path = spoilt(text, replacement)
    with pytest.raises(ConfigError) as caught:
        load_machine(path)
    assert caught.value.key == key
    assert reason in caught.value.reason
    message = str(caught.value)
    assert message.startswith(f"{path}: {key}: ")
    assert "\n" not in message


SOURCE = '[axis.x.temperature]\nnode_id = {0}\naddress = "{1}"\nk_per_count = {2}\n\n[axis.x.transmission]'


def test_a_temperature_is_an_object_of_a_node_of_the_machine(spoilt: Spoilt) -> None:
    machine = load_machine(spoilt("[axis.x.transmission]", SOURCE.format(11, "0x2A12:03", 0.1)))
    source = machine.axes["x"].temperature
    assert source is not None
    assert (source.node_id, source.index, source.subindex, source.offset_degc) == (11, 0x2A12, 3, 0.0)
    assert machine.axes["y"].temperature is None


@pytest.mark.parametrize(
    ("node_id", "address", "k_per_count", "reason"),
    [
        (127, "0x2012:00", 0.1, "temperature.node_id: node 127 is no drive or scale of this machine"),
        (1, "2012h", 0.1, "temperature.address"),
        (1, "0x2012:00", 0.0, "temperature.k_per_count"),
    ],
)
def test_a_temperature_from_nowhere_is_refused(
    spoilt: Spoilt, node_id: int, address: str, k_per_count: float, reason: str
) -> None:
    with pytest.raises(ConfigError, match=reason):
        load_machine(spoilt("[axis.x.transmission]", SOURCE.format(node_id, address, k_per_count)))


def test_a_loop_on_the_scale_needs_one(spoilt: Spoilt) -> None:
    path = spoilt(
        '[axis.x.scale]\nnode_id = 11\neds = "../../eds/linear_scale.eds"\n'
        'tpdo1 = ["position_value"]\nresolution_um = 0.1\n',
        "",
    )
    with pytest.raises(ConfigError, match=r'axis\.x\.control\.feedback: "scale" needs a scale section'):
        load_machine(path)


def test_several_mistakes_are_counted(spoilt: Spoilt) -> None:
    with pytest.raises(ConfigError, match=r"axis\.x\.control\.kp_1_s: .*\(and 1 more\)"):
        load_machine(spoilt("kp_1_s = 40.0\nkv_n_s_m = 20000.0", "kp_1_s = -1\nkv_n_s_m = -1"))


def test_a_machine_that_is_nowhere_is_told_from_those_that_are_shipped(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"xy_tabel: no such directory; machines .*: emps, .*, xy_table$"):
        load_machine(tmp_path / "xy_tabel")
    with pytest.raises(ConfigError, match=r"mine\.toml: no such file$"):
        load_machine(tmp_path / "mine.toml")


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"controller\.toml: no such file"):
        load_machine(tmp_path)
    broken = tmp_path / "controller.toml"
    broken.write_text("[machine\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"controller\.toml: not valid TOML: .*line 1"):
        load_machine(tmp_path)
    broken.write_bytes(b"[machine]\rname = 'mine'\r")
    with pytest.raises(ConfigError, match=r"controller\.toml: its lines end with CR alone"):
        load_machine(tmp_path)
    broken.write_bytes(b"\xff\xfe")
    with pytest.raises(ServoCtrlError, match="cannot be read"):
        load_machine(broken)


def test_objects_may_be_named_by_their_address(spoilt: Spoilt) -> None:
    machine = load_machine(spoilt('"target_torque"', '"0x6071:00"'))
    assert machine.axes["x"].drive.rpdo1[2] == "0x6071:00"


def test_eds_paths_are_absolute_and_beside_the_file(table: MachineConfig, machines: Path) -> None:
    assert table.axes["y"].drive.eds == machines.resolve().parent / "eds" / "servo_drive.eds"
    assert table.controller.eds.is_absolute()


def test_a_machine_cannot_be_changed(table: MachineConfig) -> None:
    with pytest.raises(ValueError, match="frozen"):
        table.axes["x"].control.kp_1_s = 1.0  # type: ignore[misc]


def test_params_are_in_si_units(table: MachineConfig) -> None:
    params = axis_params(table, "x")
    limits = table.axes["x"].limits
    assert params.period_s == pytest.approx(1e-3)
    assert params.output == Output.FORCE
    assert params.position_loop.scale_feedback
    assert params.limits.velocity_m_s == pytest.approx(limits.velocity_mm_s / 1000)
    assert params.limits.following_error_m == pytest.approx(limits.following_error_mm / 1000)
    assert params.velocity_loop.filter_blend == 1.0
    motion = motion_limits(table)
    assert motion.position_min_m.tolist() == pytest.approx([-0.1, -0.1])
    assert motion.jerk_m_s3[1] == pytest.approx(table.axes["y"].limits.jerk_mm_s3 / 1000)


def leaves(value: object) -> set[object]:
    return set().union(*map(leaves, value)) if isinstance(value, list) else {value}


def test_whole_numbers_in_the_file_freeze_to_the_same_types(spoilt: Spoilt, table: MachineConfig) -> None:
    # 40 and 40.0 would otherwise compile the control law twice
    whole = axis_params(load_machine(spoilt("kp_1_s = 40.0", "kp_1_s = 40")), "x")

    def types(value: object) -> object:
        return [types(v) for v in value] if isinstance(value, tuple) else type(value)

    assert types(whole) == types(axis_params(table, "y"))
    assert {float, int, bool, np.ndarray} == leaves(types(whole))


def test_the_velocity_filter_matches_its_time_constant() -> None:
    assert filter_blend(0.0, 1e-3) == 1.0
    assert filter_blend(5e-3, 1e-3) == pytest.approx(1 - math.exp(-0.2))


def test_emps_controller_equals_the_published_loop(machines: Path) -> None:
    params = axis_params(load_machine(machines / "emps"), "x")
    assert params.position_loop.kp_1_s == 160.18
    assert params.velocity_loop.kv_n_s_m == pytest.approx(243.45 * 35.1507)
    assert params.velocity_loop.window_samples == 2
    assert params.limits.force_n == pytest.approx(351.507)
    assert not params.position_loop.scale_feedback
    assert (params.velocity_loop.ki_n_m, params.feedforward) == (0.0, (0.0, 0.0))
