"""HOSTILE_FRAMES hostile frames on the kernel's virtual CAN; docs/hostile_bus.md."""

import os
from collections.abc import Callable, Iterator

import can
import pytest

from tests.campaigns.hostile.flood import flood, responds, silent_nodes
from tests.campaigns.hostile.frames import OWN
from tests.campaigns.hostile.scenarios import mixed

VCAN = "socketcan:vcan0"
FRAMES = int(os.environ.get("HOSTILE_FRAMES", "800")) // 2
TRAFFIC = (
    (0x000, b"\1\0"),
    (0x080, b""),
    *((0x180 + drive, bytes.fromhex("3712000000000100")) for drive in (1, 2)),
    *((0x180 + scale, bytes(4)) for scale in (11, 12)),
    *((0x200 + drive, bytes.fromhex("0f000a00000000")) for drive in (1, 2)),
    *((0x600 + node, bytes.fromhex("2340100001020304")) for node in (1, 2, 11, 12)),
    *((0x700 + node, b"\5") for node in (1, 2, 11, 12)),
)
"""One frame of each kind in the traffic of a run."""


@pytest.fixture
def station() -> Iterator[can.BusABC]:
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        yield bus


@pytest.mark.vcan
def test_controller_and_nodes_are_there_after_hostile_frames(
    start: Callable[..., object], start_simulator: Callable[[str], object], station: can.BusABC
) -> None:
    """First frames that no node must obey, to a controller in standby; then frames of every family."""
    start_simulator(VCAN)
    start(
        "python3",
        "-m",
        "tests.campaigns.hostile.controller",
        "machines/xy_table",
        VCAN,
        "standby",
        ready="stage",
    )
    harmless = flood(station, mixed(8, TRAFFIC, only_harmless=True), FRAMES)
    assert responds(station, OWN)
    any_family = flood(station, mixed(8, TRAFFIC, only_harmless=False), FRAMES)
    assert silent_nodes(station) == []
    assert harmless.frames == any_family.frames == FRAMES
    print(f"harmless {harmless}, any family {any_family}")
