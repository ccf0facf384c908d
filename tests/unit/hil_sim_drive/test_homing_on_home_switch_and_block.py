"""Homing with a home switch (methods 3 to 14, 19 to 30) and by current (-1 to -4), from anywhere."""

from pathlib import Path

import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes, SdoDrive, counts

from hil_sim.faults import jammed_axis

MASK, HOMED, ERROR = 0x3400, 0x1400, 0x2000
FAR_MM = 1000.0
CAM, POSITIVE, NEGATIVE = (-5.0, 5.0), (5.0, FAR_MM), (-FAR_MM, 5.0)
LEFT, RIGHT = -5.0, 5.0
STEP_MM = 0.002 * 1.5  # a switch is looked at every tick: 2 mm/s in 1 ms
EXPECTED = {  # switch, edge, index pulse (at 1.3 mm and every 10 mm)
    3: (POSITIVE, RIGHT, 1.3),
    4: (POSITIVE, RIGHT, 11.3),
    5: (NEGATIVE, RIGHT, 11.3),
    6: (NEGATIVE, RIGHT, 1.3),
    7: (CAM, LEFT, -8.7),
    8: (CAM, LEFT, 1.3),
    9: (CAM, RIGHT, 1.3),
    10: (CAM, RIGHT, 11.3),
    11: (CAM, RIGHT, 11.3),
    12: (CAM, RIGHT, 1.3),
    13: (CAM, LEFT, 1.3),
    14: (CAM, LEFT, -8.7),
}


def drive_at(tmp_path: Path, start_mm: float, switch: tuple[float, float] | None) -> SdoDrive:
    text = IDEAL_AXIS.read_text(encoding="utf-8").replace("../../eds", str(IDEAL_AXIS.parents[2] / "eds"))
    text = text.replace("mass_kg = 40.0", f"mass_kg = 40.0\nstart_mm = {start_mm}")
    if switch is not None:
        text += f"\n[axis.x.home_switch]\nfrom_mm = {switch[0]}\nto_mm = {switch[1]}\n"
    plant = tmp_path / "plant.toml"
    plant.write_text(text, encoding="utf-8")
    drive = SdoDrive(InProcessNodes(plant))
    drive.set(0x609A, counts(2000))
    drive.set(0x6099, counts(100), 1)
    return drive


def home_mm(drive: SdoDrive, method: int) -> float:
    drive.set(0x6098, method)
    drive.enable(6)
    drive.control(0x1F)
    objects = drive.device.objects
    drive.sync_until(lambda: objects.statusword & MASK in {HOMED, ERROR}, 20_000)
    assert drive.statusword & MASK == HOMED
    return drive.true_position_mm - drive.position_mm


@pytest.mark.parametrize("method", sorted(EXPECTED))
@pytest.mark.parametrize("start_mm", [-12.0, 0.0, 12.0])
def test_home_is_where_the_profile_has_it(tmp_path: Path, method: int, start_mm: float) -> None:
    switch, edge_mm, index_mm = EXPECTED[method]
    assert home_mm(drive_at(tmp_path, start_mm, switch), method) == pytest.approx(index_mm, abs=2e-5)
    assert home_mm(drive_at(tmp_path, start_mm, switch), method + 16) == pytest.approx(edge_mm, abs=STEP_MM)


def test_the_home_switch_is_an_input(tmp_path: Path) -> None:
    assert drive_at(tmp_path, 0.0, CAM).get(0x60FD) == 4
    assert drive_at(tmp_path, 12.0, CAM).get(0x60FD) == 0


def test_without_a_home_switch_the_search_ends_at_the_limit_switches(tmp_path: Path) -> None:
    drive = drive_at(tmp_path, 0.0, None)
    drive.set(0x6098, 7)
    drive.enable(6)
    drive.control(0x1F)
    drive.sync_until(lambda: drive.device.objects.statusword & MASK == ERROR, 5000)


@pytest.mark.parametrize(
    ("method", "block_mm", "index_mm"), [(-3, 6.0, None), (-4, -6.0, None), (-1, 6.0, 1.3), (-2, -6.0, 1.3)]
)
def test_a_block_is_found_by_the_current(
    tmp_path: Path, method: int, block_mm: float, index_mm: float | None
) -> None:
    drive = drive_at(tmp_path, 0.0, None)
    drive.set(0x6099, counts(20), 1)
    drive.set(0x2010, 300, 1)
    drive.set(0x2010, 20, 2)
    drive.set(0x6098, method)
    drive.enable(6)
    drive.control(0x1F)
    drive.sync_until(lambda: abs(drive.true_position_mm) >= abs(block_mm), 1000)
    target = drive.nodes.bench.fault_targets["x"]
    jammed_axis.begin(target, jammed_axis.Params())
    stood_mm = drive.true_position_mm
    mode = drive.device.motion.mode
    drive.sync_until(lambda: not mode.velocity, 1000)
    target.params["coulomb_friction"]["enabled"] = 0  # it blocks one direction only
    objects = drive.device.objects
    drive.sync_until(lambda: objects.statusword & MASK == HOMED, 20_000)
    zero_mm = drive.true_position_mm - drive.position_mm
    assert zero_mm == pytest.approx(stood_mm if index_mm is None else index_mm, abs=0.01)
