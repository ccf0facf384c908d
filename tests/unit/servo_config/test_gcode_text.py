"""The text of part programs: every spelling of words, and no text is skipped."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from servo_ctrl.errors import ConfigError
from servo_ctrl.motion.gcode.blocks import Block, blocks, read_text

SOURCE = Path("part.ngc")


def words(text: str) -> list[list[tuple[str, float]]]:
    return [[(word.letter, word.value) for word in block.words] for block in blocks(text, SOURCE)]


@pytest.mark.parametrize(
    "text",
    [
        "N10 G1 X10 Y-.5 F600",
        "n10g1x10y-.5f600",
        "N10 G01 X+10. Y-0.50 F 600.",
        "N 10 G 1 X 10 Y -.5 F600 ; to the corner (not the edge",
        "(first) N10 (second) G1 X10 Y-.5 (third; fourth) F600 (fifth)",
        "\tN0010\tG1\tX010\tY-00.5\tF600  ",
    ],
)
def test_words_are_the_same_however_they_are_written(text: str) -> None:
    assert words(text) == [[("N", 10.0), ("G", 1.0), ("X", 10.0), ("Y", -0.5), ("F", 600.0)]]


def test_lines_are_counted_as_an_editor_does() -> None:
    text = "%\n\n(comment)\nG0 X1\n   \n/G0 X2 ; left out\n/2 X3\n%\nnot read"
    found = list(blocks(text, SOURCE))
    assert [(block.line, block.optional) for block in found] == [(4, False), (6, True), (7, True), (8, False)]
    assert words(text) == [[("G", 0.0), ("X", 1.0)], [("G", 0.0), ("X", 2.0)], [("X", 3.0)], []]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G1 X", "a number is missing behind X"),
        ("G1 X-", "a number is missing behind X"),
        ("G1 Xabc", "a number is missing behind X"),
        ("G1 X1,5", "',5' is not a word"),
        ("G1 X1 0", "'0' is not a word"),
        ("G1 X1..2", "'.2' is not a word"),
        ("G1 X--1", "a number is missing behind X"),
        ("G1 X1 @ Y2", "'@ Y2' is not a word"),
        ("G1 Ä5 X1", "'Ä5 X1' is not a word"),
        ("G1 X٣", "a number is missing behind X"),
        ("G1 X1\x00", "is not a word"),
        ("G1 X1 %", "'%' is not a word"),
        ("G1 X1 / Y2", "'/ Y2' is not a word"),
        ("(open G1 X5", "the comment '(open G1 X5' is not closed"),
        ("G1 X5)", "')' is not a word"),
        ("G1 X#1", "variables and expressions are not understood"),
        ("#1 = 5", "variables and expressions are not understood"),
        ("G1 X[1+2]", "variables and expressions are not understood"),
        ("IF [#1 EQ 0] GOTO 20", "variables and expressions are not understood"),
        ("O100 sub", "subprograms are not understood"),
        ("o<part> call", "variables and expressions are not understood"),
        ("G1 X" + "9" * 400, "the number is too large"),
    ],
)
def test_an_invalid_word_is_an_error_with_its_line(text: str, reason: str) -> None:
    with pytest.raises(ConfigError) as caught:
        words("G21\n" + text + "\nM2")
    assert (caught.value.file, caught.value.key) == ("part.ngc", "line 2")
    assert reason in caught.value.reason


NUMBERS = st.from_regex(r"\A[+-]?([0-9]{1,6}(\.[0-9]{0,4})?|\.[0-9]{1,4})\Z")
WORDS = st.lists(st.tuples(st.sampled_from("GXYZIJRFPSTM"), NUMBERS), min_size=1, max_size=6)
SPACES = st.sampled_from(["", " ", "\t", "  "])
COMMENTS = st.sampled_from(["", "(a b)", "()", "(;)"])


@given(st.lists(WORDS, min_size=1, max_size=5), st.data())
def test_every_word_is_read_with_its_line(
    lines: Sequence[Sequence[tuple[str, str]]], data: st.DataObject
) -> None:
    text = ""
    for line in lines:
        for letter, number in line:
            shown = data.draw(st.sampled_from([letter, letter.lower()]))
            text += shown + data.draw(SPACES) + number + data.draw(SPACES) + data.draw(COMMENTS)
        text += data.draw(st.sampled_from(["\n", " ; X9\n"]))
    found: list[Block] = list(blocks(text, SOURCE))
    assert [block.line for block in found] == list(range(1, len(lines) + 1))
    for block, line in zip(found, lines, strict=True):
        assert [(word.letter, word.value) for word in block.words] == [(a, float(b)) for a, b in line]


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "latin-1"])
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_comments_may_have_any_encoding_and_lines_any_ending(code: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / "part.ngc"
    path.write_bytes(ending.join(["(Bohrung ø5, Maß)", "G0 X1", "M2"]).encode(code))
    found = list(blocks(read_text(path), path))
    assert [block.line for block in found] == [2, 3]


def test_a_file_that_cannot_be_read_is_an_error_that_names_it(tmp_path: Path) -> None:
    for path, reason in ((tmp_path / "none.ngc", "no such file"), (tmp_path, "cannot be read")):
        with pytest.raises(ConfigError, match=reason) as caught:
            read_text(path)
        assert caught.value.file == str(path)


def test_an_endless_file_is_not_read_to_its_end() -> None:
    with pytest.raises(ConfigError, match="larger than 50 MB"):
        read_text(Path("/dev/zero"))
