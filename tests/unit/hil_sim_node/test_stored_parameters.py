"""Parameters are stored and restored across a restart of the simulator."""

import json
from pathlib import Path

import canopen
import pytest
from in_process_nodes import IDEAL_AXIS, InProcessNodes, SdoDrive

from hil_sim.config import ConfigError

SAVE, LOAD = 0x65766173, 0x64616F6C


def drive_with(directory: Path | None) -> SdoDrive:
    return SdoDrive(InProcessNodes(IDEAL_AXIS, directory))


def test_saved_parameters_survive_a_restart_and_set_points_do_not(tmp_path: Path) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 4321)
    drive.set(0x1017, 25)
    drive.set(0x607A, 99)
    drive.set(0x1010, SAVE, 1)
    again = drive_with(tmp_path)
    assert (again.get(0x6081), again.get(0x1017), again.get(0x607A)) == (4321, 25, 0)
    assert list(tmp_path.glob("*.tmp")) == []


def test_unsaved_parameters_are_gone_after_a_restart(tmp_path: Path) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 4321)
    assert drive_with(tmp_path).get(0x6081) == 5242880


@pytest.mark.parametrize(("group", "kept"), [(2, (5242880, 25)), (3, (4321, 0))])
def test_groups_are_saved_apart(tmp_path: Path, group: int, kept: tuple[int, int]) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 4321)
    drive.set(0x1017, 25)
    drive.set(0x1010, SAVE, group)
    again = drive_with(tmp_path)
    assert (again.get(0x6081), again.get(0x1017)) == kept


def test_restored_defaults_act_at_the_next_reset(tmp_path: Path) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 4321)
    drive.set(0x1010, SAVE, 1)
    drive.set(0x1011, LOAD, 1)
    assert drive.get(0x6081) == 4321
    drive.nodes.put(0, b"\x81\x01")
    assert drive.get(0x6081) == 5242880
    assert drive_with(tmp_path).get(0x6081) == 5242880


def test_without_a_directory_values_last_as_long_as_the_process() -> None:
    drive = drive_with(None)
    drive.set(0x6081, 4321)
    drive.set(0x1010, SAVE, 1)
    drive.nodes.put(0, b"\x81\x01")
    assert drive.get(0x6081) == 4321


def test_saved_pdo_mapping_is_active_after_a_restart(tmp_path: Path) -> None:
    drive = drive_with(tmp_path)
    drive.node.tpdo.read()
    pdo = drive.node.tpdo[2]
    pdo.clear()
    pdo.add_variable(0x6064)
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()
    drive.set(0x1010, SAVE, 1)
    again = drive_with(tmp_path)
    again.nodes.operational()
    again.nodes.frames.clear()
    again.nodes.sync()
    assert again.nodes.take(0x281) == [bytes(4)]


@pytest.mark.parametrize(("index", "value"), [(0x1010, LOAD), (0x1010, 1), (0x1011, SAVE)])
def test_wrong_signatures_are_refused(index: int, value: int) -> None:
    drive = drive_with(None)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(index, value, 1)
    assert refusal.value.code == 0x08000020


def test_nothing_is_stored_while_the_motor_has_power() -> None:
    drive = drive_with(None)
    drive.enable(3)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1010, SAVE, 1)
    assert refusal.value.code == 0x08000022


def test_capability_reads_save_on_command() -> None:
    drive = drive_with(None)
    assert [drive.get(0x1010, 1), drive.get(0x1011, 3)] == [1, 1]


@pytest.mark.parametrize(
    "content",
    [
        "{",
        "[1]",
        '{"6081": "00"}',
        '{"6081:00": "zz"}',
        '{"6081:00": "00"}',  # too short
        '{"7777:00": "00"}',  # no such object
        '{"6083:00": "00000000"}',  # below its limit
        '{"6041:00": "2700"}',  # not a parameter
    ],
)
def test_a_damaged_file_is_named(tmp_path: Path, content: str) -> None:
    (tmp_path / "node_1.json").write_text(content, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"node_1\.json"):
        InProcessNodes(IDEAL_AXIS, tmp_path)


def test_stored_file_is_plain_text(tmp_path: Path) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 0x01020304)
    drive.set(0x1010, SAVE, 1)
    content = json.loads((tmp_path / "node_1.json").read_text(encoding="utf-8"))
    assert content["6081:00"] == "04030201"


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "node_1.json").mkdir()
    with pytest.raises(ConfigError, match=r"node_1\.json: stored parameters: Is a directory"):
        InProcessNodes(IDEAL_AXIS, tmp_path)


def test_a_failed_save_leaves_file_and_memory_as_they_were(tmp_path: Path) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 1111)
    drive.set(0x1010, SAVE, 1)
    (tmp_path / "node_1.tmp").mkdir()  # the new file cannot be written
    drive.set(0x6081, 2222)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1010, SAVE, 1)
    assert refusal.value.code == 0x08000020
    drive.nodes.put(0, b"\x81\x01")
    assert drive.get(0x6081) == 1111


def test_a_kill_in_the_middle_of_a_save_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = drive_with(tmp_path)
    drive.set(0x6081, 1111)
    drive.set(0x1010, SAVE, 1)

    def killed(_descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("hil_sim.node.storage.os.fsync", killed)
    drive.set(0x6081, 2222)
    with pytest.raises(KeyboardInterrupt):
        drive.set(0x1010, SAVE, 1)
    assert (tmp_path / "node_1.tmp").exists()
    assert drive_with(tmp_path).get(0x6081) == 1111


def test_an_invalid_stored_mapping_leaves_its_pdo_off(tmp_path: Path) -> None:
    """The file is as an older version may have written it."""
    (tmp_path / "node_1.json").write_text('{"1600:00": "01", "1600:01": "08007e60"}', encoding="utf-8")
    drive = drive_with(tmp_path)
    drive.nodes.operational()
    drive.nodes.put(0x201, b"\x06")
    assert drive.state == "switch on disabled"
