"""The likely cause named for a fault of an axis shortly after missed ticks or inputs."""

from pathlib import Path

from ideal_drives import PERIOD_S, Stand, ideal_machine_file

from servo_ctrl.daemon.cycle.machine_state import DISTURBANCE_REMARK, DISTURBANCE_S

FOREIGN_COUNTS = 2**18  # 2.5 mm
DOUBT_CYCLES = round(DISTURBANCE_S / PERIOD_S)


def reason_of_an_axis_off_its_path(stand: Stand) -> str:
    stand.drives[0].position += FOREIGN_COUNTS
    stand.run(1)
    reason: str = stand.machine.reason
    assert "axis x: following error" in reason
    return reason


def test_the_computer_is_named_where_ticks_were_missing(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start().run(1, elapsed=3).run(5)
    assert reason_of_an_axis_off_its_path(stand).endswith(DISTURBANCE_REMARK)


def test_the_bus_is_named_where_inputs_were_missing(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start()
    stand.absent = {1}
    stand.run(1)
    stand.absent = set()
    stand.run(5)
    assert reason_of_an_axis_off_its_path(stand).endswith(DISTURBANCE_REMARK)


def test_no_cause_is_named_once_it_is_long_ago(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start().run(1, elapsed=3).run(DOUBT_CYCLES)
    assert "missing" not in reason_of_an_axis_off_its_path(stand)


def test_no_cause_is_named_where_nothing_was_missing(tmp_path: Path) -> None:
    stand = Stand(ideal_machine_file(tmp_path)).start()
    assert "missing" not in reason_of_an_axis_off_its_path(stand)
