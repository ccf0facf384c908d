"""How an operator runs a program: single block, optional stop, from a line, lines of their own."""

from pathlib import Path

import numpy as np
import pytest
from ideal_drives import COUNT_M, OperatedStand
from operated_programs import line, load, run_out, speed_m_s

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_program
from servo_ctrl.errors import ConfigError


def test_single_block_holds_after_every_block_and_the_line_in_motion_is_shown(loaded: OperatedStand) -> None:
    made = loaded
    made.handler.jog_step("x", 0.001)
    run_out(made)
    assert made.handler.change("single_block", True).accepted
    made.ask(Command.START_PROGRAM)
    stood, lines = [], []
    for _ in range(4):
        made.run(400)
        assert made.status.program.held_by == "single block"
        stood.append([round(x * 1e3, 6) for x in made.commanded_m()[-1]])
        made.ask(Command.RESUME_PROGRAM)
        made.run(30)
        lines.append(made.status.program.line)
    assert stood == [[0, 0], [4, 0], [4, 3], [0, 3]]
    assert lines == [3, 4, 6, 7]
    run_out(made)
    assert not made.status.program.held, "nothing is held behind the last block"
    assert made.status.program.line == 0


def test_optional_stop_holds_at_m1_where_it_is_on(loaded: OperatedStand) -> None:
    made = loaded
    made.ask(Command.START_PROGRAM)
    run_out(made)
    made.handler.change("optional_stop", True)
    made.ask(Command.START_PROGRAM)
    made.run(2000)
    assert (made.status.program.held, made.status.program.held_by) == (True, "optional stop, line 5")
    assert made.commanded_m()[-1] == pytest.approx([0.004, 0.003], abs=1e-12)
    made.ask(Command.RESUME_PROGRAM)
    run_out(made)


def test_a_program_is_run_from_a_line_with_what_held_there(loaded: OperatedStand, tmp_path: Path) -> None:
    made = loaded
    made.handler.jog_step("x", -0.002)
    run_out(made)
    assert load(made, tmp_path, first_line=6) == ""
    assert made.status.program.entry == "line 6: G1 G17 G21 G90 G54 G64 P0.05 F1200"
    first = len(made.commanded_m())
    made.ask(Command.START_PROGRAM)
    run_out(made)
    path_m = made.commanded_m()[first:]
    ends = np.flatnonzero((path_m == [0.004, 0.003]).all(axis=1))
    assert len(ends), "it goes first to where the line before ends"
    approach = path_m[: ends[0]]
    assert np.abs(approach[:, 1] - 0.5 * (approach[:, 0] + 0.002)).max() < 1e-9, "straight"
    behind = path_m[ends[0] :]
    assert np.median(speed_m_s(behind[behind[:, 0] > 0.001])) == pytest.approx(0.02, rel=1e-6)
    with pytest.raises(ConfigError, match="line 60: the program ends before, at line 8"):
        load(made, tmp_path, first_line=60)


def test_a_line_of_its_own_goes_on_from_the_one_before_and_leaves_the_program(
    loaded: OperatedStand, tmp_path: Path
) -> None:
    made = loaded
    assert line(made, tmp_path, "G91 G1 X1 F600") == ""
    assert made.machine.stage is Stage.RUNNING
    assert (made.status.program.apart, made.status.program.name) == (True, "bracket.ngc")
    run_out(made)
    assert line(made, tmp_path, "Y2") == "", "G91, G1 and F600 hold"
    run_out(made)
    assert made.positions_m() == pytest.approx([0.001, 0.002], abs=COUNT_M)
    assert made.status.program.modes == "G1 G17 G21 G91 G54 G64 P0.01 F600"
    assert line(made, tmp_path, "G90 G0 X0 Y0") == ""
    assert line(made, tmp_path, "X1") == "the machine is running, not ready"
    run_out(made)
    assert "axis x: position" in line(made, tmp_path, "X500")
    made.ask(Command.START_PROGRAM)
    run_out(made)
    assert made.status.program.apart is False


def test_a_line_read_before_the_axes_moved_is_refused(loaded: OperatedStand, tmp_path: Path) -> None:
    made = loaded
    path = tmp_path / "line.ngc"
    path.write_text("G91 G0 X1", encoding="utf-8")
    read = load_program(path, made.config, reading=made.handler.reading_of_line())
    made.handler.jog_step("x", 0.001)
    run_out(made)
    assert made.handler.run_line(read).reason == "the axes have moved while the line was read; send it again"
