"""The load of a bus from its own bit rate, and interfaces whose rate is another than the file says."""

import json
import math
from pathlib import Path

import pytest
from machine_files import XY_TABLE, text_of, write_controller

from servo_ctrl.canopen.bus_load import check_load, cyclic_load
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ConfigError
from servo_ctrl.io.bit_rate import rate_problem


def at(folder: Path, rate: int, period_us: int = 1000) -> MachineConfig:
    changes = {
        "sync_period_us = 1000": f"sync_period_us = {period_us}\nbit_rate_kbit_s = {rate}",
        "limit_switch_syncs = 10": "limit_switch_syncs = 0",
        "heartbeat_ms = 100": "heartbeat_ms = 0",
    }
    return load_machine(write_controller(folder, text_of(XY_TABLE / "controller.toml", changes)))


def test_the_load_is_that_of_the_frames_by_hand(tmp_path: Path) -> None:
    """SYNC 55 bits, two RPDOs of 7 bytes, two TPDOs of 8, two of 4: stuffed as much as may be."""
    machine = at(tmp_path, 1000)
    by_hand = 55 + 2 * (47 + 56 + 22) + 2 * (47 + 64 + 24) + 2 * (47 + 32 + 16)
    assert math.isclose(cyclic_load(machine, plan_machine(machine)), by_hand / 1000.0)


@pytest.mark.parametrize(("rate", "period_us"), [(500, 2000), (250, 4000), (125, 10_000)])
def test_half_the_rate_is_twice_the_load(rate: int, period_us: int, tmp_path: Path) -> None:
    full, slow = at(tmp_path, 1000, period_us), at(tmp_path, rate, period_us)
    loads = [cyclic_load(machine, plan_machine(machine)) for machine in (full, slow)]
    assert math.isclose(loads[1], loads[0] * 1000 / rate)


def test_a_cycle_that_the_bus_cannot_carry_is_refused(tmp_path: Path) -> None:
    machine = at(tmp_path, 500)
    with pytest.raises(
        ConfigError, match=r"bus.bit_rate_kbit_s: a cycle of 1000 us needs 153 % of 500 kbit/s"
    ):
        check_load(machine, plan_machine(machine))


@pytest.mark.parametrize("key", ["fd = true", "data_bit_rate_kbit_s = 4000"])
def test_can_fd_is_refused_in_words(key: str, tmp_path: Path) -> None:
    text = text_of(XY_TABLE / "controller.toml", {"[bus]": f"[bus]\n{key}"})
    with pytest.raises(ConfigError, match=rf"bus\.{key.split(maxsplit=1)[0]}: CAN FD is not supported"):
        load_machine(write_controller(tmp_path, text))


@pytest.mark.parametrize(
    ("info", "warning"),
    [
        (
            {"bittiming": {"bitrate": 500_000}},
            "bus socketcan:can0 runs at 500 kbit/s, the machine file says 1000",
        ),
        ({"bittiming": {"bitrate": 1_000_000}}, ""),
        (
            {"bittiming": {"bitrate": 1_000_000}, "data_bittiming": {"bitrate": 4_000_000}},
            "is set up for CAN FD",
        ),
        (None, ""),
    ],
)
def test_an_interface_at_another_rate_is_reported(info: object, warning: str) -> None:
    answer = json.dumps([{"ifname": "can0", "linkinfo": {"info_kind": "can", "info_data": info}}])
    assert warning in rate_problem("socketcan:can0", 1000, lambda _channel: answer)
    assert bool(warning) == bool(rate_problem("socketcan:can0", 1000, lambda _channel: answer))


@pytest.mark.parametrize("answer", ["", "[]", "nonsense", "[{}]", '[{"linkinfo": 3}]'])
def test_an_unknown_interface_is_not_reported(answer: str) -> None:
    assert rate_problem("socketcan:can0", 1000, lambda _channel: answer) == ""
    assert rate_problem("localcan:/x", 1000) == ""
