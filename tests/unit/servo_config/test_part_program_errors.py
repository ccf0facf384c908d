"""Part programs that are refused: file, line and reason, and never anything else than a ConfigError."""

import re
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from servo_ctrl.config.part_program import ReadingOptions
from servo_ctrl.config.part_program_reader import read_part_program
from servo_ctrl.errors import ConfigError
from servo_ctrl.motion.gcode.words import G_CODES, M_CODES, Effect

HEAD = "G21 G90\nG0 X0 Y0\n"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("nc") / "part.ngc"


def refusal(path: Path, text: str, axes: str = "xy") -> ConfigError:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_part_program(path, list(axes))
    assert caught.value.file == str(path)
    return caught.value


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        # the first motion
        (HEAD.replace("G0", "G91 G0").replace("G90", ""), 2, "must be a straight one in absolute coord"),
        ("G2 X1 Y1 R1 F60", 1, "must be a straight one in absolute coordinates"),
        ("G0 X0\nG1 X1 F60\nY1", 3, "axis y is not named by line 1; the first motion must"),
        ("G0 X0\nG91 G1 Y1 F60", 2, "axis y is not named by line 1"),
        ("G0 X0\nG2 X2 I1 F60", 2, "axis y is not named by line 1"),
        # motion words
        ("X0 Y0", 1, "which motion? G0, G1, G2 or G3 is missing"),
        (HEAD + "G1 X1", 3, "G1 needs a feed: F is missing"),
        (HEAD + "G2 X1 Y1 R1", 3, "G2 needs a feed: F is missing"),
        (HEAD + "G1 X1 F0", 3, "F 0: the feed must be above 0"),
        (HEAD + "G1 X1 F-5", 3, "F -5: the feed must be above 0"),
        (HEAD + "G0 G1 X1 F60", 3, "G0 and G1 contradict each other in one block"),
        (HEAD + "G1 G1 X1 F60", 3, "G1 and G1 contradict each other"),
        (HEAD + "G90 G91 X1", 3, "G90 and G91 contradict each other"),
        (HEAD + "G20 G21 X1", 3, "G20 and G21 contradict each other"),
        (HEAD + "M2 M30", 3, "M2 and M30 contradict each other"),
        (HEAD + "G1 X1 X2 F60", 3, "X1 and X2 in one block"),
        (HEAD + "G1 X1 F60 F70", 3, "F60 and F70 in one block"),
        (HEAD + "G0 Z5", 3, 'Z5: the machine has no axis "z", only x, y'),
        (HEAD + "G0 A90", 3, 'A90: the machine has no axis "a", only x, y'),
        # words that mean nothing where they are
        (HEAD + "G1 X1 F60 I5", 3, "I5: means nothing in this block"),
        (HEAD + "G1 X1 F60 R5 P2", 3, "R5, P2: means nothing in this block"),
        (HEAD + "G0 X1 E3", 3, "E3: means nothing"),
        (HEAD + "P5", 3, "P5: means nothing"),
        (HEAD + "G9", 3, "G9 belongs to a motion"),
        (HEAD + "G0 X1 N5", 3, "N5: means nothing"),
        (HEAD + "O100", 3, "O100: subprograms are not understood"),
        (HEAD + "G0 X1 O100", 3, "O100: subprograms are not understood"),
        (HEAD + "G12 X1", 3, "G12: unknown G word"),
        (HEAD + "G1.5 X1", 3, "G1.5: unknown G word"),
        (HEAD + "G-1 X1", 3, "G-1: unknown G word"),
        (HEAD + "M77", 3, "M77: unknown M word"),
        (HEAD + "M3.5", 3, "M3.5: unknown M word"),
        # arcs
        (HEAD + "G2 X5 Y5 F60", 3, "G2: the centre is given either by R or by I and J"),
        (HEAD + "G2 X5 Y5 R5 I5 F60", 3, "G2: the centre is given either by R or by I and J"),
        (HEAD + "G2 X5 Y5 I5 K0 F60", 3, "K0: means nothing"),
        (HEAD + "G3 X0 Y0 R5 F60", 3, "G3: an arc with R must end elsewhere than it starts"),
        (
            HEAD + "G3 X10 Y0 R4.9 F60",
            3,
            "R 4.9 mm is too small: start and end are 10 mm apart, which takes 5 mm",
        ),
        (HEAD + "G3 X10 Y0 R0 F60", 3, "R 0 mm is too small"),
        (HEAD + "G3 X5 I0 J0 F60", 3, "the centre is the start: the radius is 0"),
        (HEAD + "G2 X10.02 Y0 I5 F60", 3, "the radius is 5 mm at the start and 5.02 mm at the end"),
        (HEAD + "G2 X200.03 Y0 I100 F60", 3, "the radius is 100 mm at the start and 100.03 mm at the end"),
        (HEAD + "G18", 3, 'G18 needs z and x: the machine has no axis "z", only x, y'),
        (HEAD + "G19", 3, 'G19 needs y and z: the machine has no axis "z"'),
        # dwell, tolerance
        (HEAD + "G4", 3, "G4 needs its time: P or X, in seconds"),
        (HEAD + "G4 P-1", 3, "P -1: a dwell takes 0 to 86400 seconds"),
        (HEAD + "G4 P100000", 3, "P 100000: a dwell takes 0 to 86400 seconds"),
        (HEAD + "G4 P1 X1", 3, "X1: means nothing"),
        (HEAD + "G4 P1 G1", 3, "G4 needs a block of its own"),
        (HEAD + "G4 P1 G64", 3, "G4 needs a block of its own"),
        (HEAD + "G64 P-0.1", 3, "the tolerance must not be below 0"),
        (HEAD + "G61 P0.1", 3, "P0.1: means nothing"),
        # a program that does nothing
        ("", 1, "has moved nothing"),
        ("%\n%", 2, "has moved nothing"),
        ("G21\nF100\nM2\nG0 X5", 3, "has moved nothing"),
    ],
)
def test_an_impossible_block_is_refused_with_its_line(path: Path, text: str, line: int, reason: str) -> None:
    error = refusal(path, text)
    assert error.key == f"line {line}"
    assert reason in error.reason


@pytest.mark.parametrize(
    "word", [name for name, code in (G_CODES | M_CODES).items() if code.effect is Effect.REFUSED]
)
def test_refused_words_give_the_reason(path: Path, word: str) -> None:
    error = refusal(path, HEAD + word + " X1 F5")
    assert (error.key, error.reason) == ("line 3", f"{word}: {(G_CODES | M_CODES)[word].meaning}")


def test_a_missing_axis_of_the_plane_is_named(path: Path) -> None:
    error = refusal(path, "G0 X0\nG2 X2 I1 F60", "x")
    assert (error.key, error.reason) == ("line 2", 'G17 needs x and y: the machine has no axis "y", only x')


def test_a_work_offset_of_a_missing_axis_is_refused(path: Path) -> None:
    path.write_text(HEAD, encoding="utf-8")
    with pytest.raises(ConfigError, match=r'--g54: the machine has no axis "z", only x, y'):
        read_part_program(path, ["x", "y"], ReadingOptions({"z": 1.0}))


FRAGMENTS = [
    "G0 X0 Y0\n",
    "G1 F60 ",
    "G2 ",
    "G3 ",
    "X1 Y1 ",
    "I5",
    "R5 ",
    "G91 ",
    "G20 ",
    "G64 P0.1",
    "G4 P1\n",
]
ODDITIES = ["G61\n", "M2\n", "\x00", "\x85", "é", "9" * 320, "E9"]
PIECES = st.sampled_from([*"GMXYIJRFPNOST#()[]=%/;.-+ \n\t0123456789", *FRAGMENTS, *ODDITIES])


@given(st.one_of(st.text(max_size=60), st.lists(PIECES, max_size=30).map("".join)))
@example("G0 X0 Y0\nG2 X1e-300 R1e-300 F1")
@example("G0 X999999999 Y-999999999\nG91 G2 X999999999 I999999999 J999999999 F1")
@example("G0 X0 Y0\nG3 X.00000000000001 Y0 I1 F1")
@example("G0 X0 Y0\nG3 X.000001 Y0 R.0000000001 F1")
def test_any_text_is_a_program_or_an_error_with_its_line(path: Path, text: str) -> None:
    path.write_bytes(text.encode("utf-8", errors="replace"))
    try:
        program = read_part_program(path, ["x", "y"])
    except ConfigError as error:
        key = error.key
    else:
        key = f"line {program.blocks}"  # at least one did something
    assert re.fullmatch(r"line [1-9][0-9]*", key)
