"""Touch probes 60B8h: selected edge, time, resolution, first or continuous, of input or index pulse."""

from pathlib import Path

import canopen
import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes, SdoDrive, counts

FIRST_MM, SECOND_MM = 3.0, 4.0


@pytest.fixture
def drive(tmp_path: Path) -> SdoDrive:
    text = IDEAL_AXIS.read_text(encoding="utf-8").replace("../../eds", str(IDEAL_AXIS.parents[2] / "eds"))
    plant = tmp_path / "plant.toml"
    text += f"\n[axis.x.touch_probes]\nfirst_mm = {FIRST_MM}\nsecond_mm = {SECOND_MM}\n"
    plant.write_text(text, encoding="utf-8")
    drive = SdoDrive(InProcessNodes(plant))
    drive.set(0x6081, counts(100))
    drive.enable(1)
    return drive


def go(drive: SdoDrive, millimetres: float) -> None:
    drive.set(0x607A, counts(millimetres))
    drive.control(0x1F)
    drive.control(0x0F)
    drive.nodes.sync(400)


def stored_mm(drive: SdoDrive, index: int) -> float:
    return drive.get(index) / counts(1)


def test_both_edges_of_both_inputs_are_stored_where_the_table_was(drive: SdoDrive) -> None:
    drive.set(0x60B8, 0x3131)
    assert drive.get(0x60B9) == 0x0101
    go(drive, 6.0)
    assert drive.get(0x60B9) == 0x0303
    go(drive, 0.0)
    assert drive.get(0x60B9) == 0x0707
    for index, place_mm in ((0x60BA, FIRST_MM), (0x60BB, FIRST_MM), (0x60BC, SECOND_MM), (0x60BD, SECOND_MM)):
        assert stored_mm(drive, index) == pytest.approx(place_mm, abs=0.002)


@pytest.mark.parametrize(("function", "passes", "seen"), [(0x11, 2, 1), (0x13, 2, 2), (0x11, 1, 1)])
def test_the_first_edge_or_every_one(drive: SdoDrive, function: int, passes: int, seen: int) -> None:
    drive.set(0x60B8, function)
    for _ in range(passes):
        go(drive, 5.0)
        first = drive.get(0x60BA)
        drive.set(0x607C, 0)
        drive.device.objects.touch_probe_1_positive_edge = 0
        go(drive, 0.0)
    assert bool(first) == (seen == passes)


def test_an_edge_that_is_not_selected_and_a_disabled_probe_store_nothing(drive: SdoDrive) -> None:
    drive.set(0x60B8, 0x21)
    go(drive, 5.0)
    assert (drive.get(0x60B9), drive.get(0x60BA), drive.get(0x60BC)) == (0x01, 0, 0)
    go(drive, 0.0)
    assert drive.get(0x60B9) == 0x05
    drive.set(0x60B8, 0)
    assert drive.get(0x60B9) == 0


def test_the_index_pulse_is_stored_to_the_count(drive: SdoDrive) -> None:
    drive.set(0x60B8, 0x15)
    go(drive, 5.0)
    assert drive.get(0x60B9) == 0x03
    assert drive.get(0x60BA) == pytest.approx(1.3 * 1_048_576 / 10.0, abs=1)


def test_switching_on_again_forgets_what_was_stored(drive: SdoDrive) -> None:
    drive.set(0x60B8, 0x11)
    go(drive, 5.0)
    drive.set(0x60B8, 0)
    drive.set(0x60B8, 0x11)
    assert drive.get(0x60B9) == 0x01


def test_reserved_functions_are_refused(drive: SdoDrive) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refused:
        drive.set(0x60B8, 0x0008)
    assert refused.value.code == 0x06090030


def test_an_input_that_is_not_connected_has_no_edge() -> None:
    drive = SdoDrive(InProcessNodes())
    drive.enable(1)
    drive.set(0x60B8, 0x3131)
    go(drive, 6.0)
    assert drive.get(0x60B9) == 0x0101
