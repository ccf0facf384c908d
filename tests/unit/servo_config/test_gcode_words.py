"""The table of words in docs/part_programs.md is that of the reader."""

import re
from pathlib import Path

from servo_ctrl.motion.gcode.words import G_CODES, LETTERS_WITHOUT_EFFECT, M_CODES, Effect, code_name

PAGE = (Path(__file__).parents[3] / "docs" / "part_programs.md").read_text(encoding="utf-8")


def test_the_documented_words_are_the_known_ones() -> None:
    table = re.search(r"<!-- words -->\n(.*?)<!-- end -->", PAGE, re.DOTALL)
    assert table
    known = [(name, code.effect.value, code.meaning) for name, code in (G_CODES | M_CODES).items()]
    known += [(letter, Effect.NONE.value, text) for letter, text in LETTERS_WITHOUT_EFFECT.items()]
    rows = [f"| `{name}` | {effect} | {meaning} |" for name, effect, meaning in known]
    assert table[1].splitlines()[2:] == rows, "\n".join(rows)


def test_every_word_is_found_however_it_is_written() -> None:
    for name in G_CODES | M_CODES:
        for written in (name[1:], "0" + name[1:], name[1:] + ("0" if "." in name else ".0")):
            assert code_name(name[0], float(written)) == name
