"""Blocks of a part program: ends of paths, stops, deleted blocks, and remarks with their line."""

from itertools import pairwise

import pytest
from part_programs import Read, elements, ends_mm, reader

from servo_ctrl.motion.move import Dwell
from servo_ctrl.motion.path.path_move import PathMove


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> Read:
    return reader(tmp_path_factory.mktemp("nc"))


def test_paths_end_at_dwells_at_other_tolerances_and_behind_the_first_motion(read: Read) -> None:
    text = "G0 X0 Y0\nG1 X1 F60\nX2\nG4 P.5\nX3\nG64 P.05\nX4\nX5\nG4 X2\nG4 P0\nM2"
    steps = read(text).motion
    assert [step.label for step in steps] == [
        "approach, line 1",
        "lines 2-3",
        "dwell, line 4",
        "line 5",
        "lines 7-8",
        "dwell, line 9",
    ]
    assert [step.duration_s for step in steps if isinstance(step, Dwell)] == [0.5, 2.0]
    paths = [step for step in steps if isinstance(step, PathMove)]
    assert [path.tolerance_m for path in paths] == pytest.approx([10e-6, 10e-6, 10e-6, 50e-6])
    assert all(path.elements[-1].exact_stop for path in paths)


def test_exact_stop_is_modal_by_g61_and_once_by_g9(read: Read) -> None:
    text = "G0 X0 Y0\nG1 X1 F60\nG9 X2\nX3\nG61 X4\nG9 X5\nG64 X6\nX7\nM2"
    stops = [element.line for element in elements(read(text)) if element.exact_stop]
    assert stops == [1, 3, 5, 6, 8]


def test_a_block_without_travel_makes_no_element_but_keeps_its_stop(read: Read) -> None:
    program = read("G0 X0 Y0\nG1 X1 F60\nX1 Y0\nG9 X1\nX2\nM2")
    assert [(element.line, element.exact_stop) for element in elements(program)] == [
        (1, True),
        (2, True),
        (5, True),
    ]


def test_text_after_the_program_end_is_not_read(read: Read) -> None:
    for end in ("M2", "M30", "G1 X5 M2", "%"):
        program = read(f"G0 X0 Y0\nG1 X5 F60\n{end}\nthis is not G-code")
        assert ends_mm(program)[-1] == (5, 0)
        assert program.remarks == []


def test_block_delete_leaves_blocks_out_when_asked(read: Read) -> None:
    text = "G0 X0 Y0\n/G0 X1\nG0 X2\nM2"
    assert ends_mm(read(text)) == [(0, 0), (1, 0), (2, 0)]
    assert [(remark.line, remark.word) for remark in read(text).remarks] == [(2, "/")]
    assert ends_mm(read(text, block_delete=True)) == [(0, 0), (2, 0)]


def test_words_without_effect_are_listed_with_their_line(read: Read) -> None:
    program = read("O1000 (PART)\nN10 G21 G17 G40 G49 G80 G90 G94\nT1 M6\nS8000 M3 M8\nG0 X0 Y0\nM9")
    listed = [(remark.line, remark.word) for remark in program.remarks]
    assert listed == [(3, "T1"), (3, "M6"), (4, "S8000"), (4, "M3"), (4, "M8"), (6, "M9"), (6, "")]
    assert "is the file complete?" in program.remarks[-1].text


def test_a_hundred_thousand_lines_are_read_in_order(read: Read) -> None:
    text = "G0 X0 Y0\nG1 F1000\n" + "\n".join(f"N{n} X{n % 7}.5 Y{n % 5}" for n in range(100_000)) + "\nM2"
    program = read(text)
    lines = [element.line for element in elements(program)]
    assert len(lines) == 100_001
    assert all(a < b for a, b in pairwise(lines))
