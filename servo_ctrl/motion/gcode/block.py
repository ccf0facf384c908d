"""Sorts the words of a block; refuses unknown, unsupported, repeated and contradictory words."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from servo_ctrl.errors import ConfigError
from servo_ctrl.motion.gcode.blocks import Block, Word, line_key
from servo_ctrl.motion.gcode.words import G_CODES, LETTERS_WITHOUT_EFFECT, M_CODES, Effect, code_name


@dataclass(slots=True)
class SortedBlock:
    """A block: G and M words by group, the others by letter."""

    line: int
    source: Path
    codes: dict[str, str] = field(default_factory=dict)
    words: dict[str, Word] = field(default_factory=dict)
    """Words not used yet, by letter."""
    without_effect: list[Word] = field(default_factory=list)

    def take(self, letter: str) -> float | None:
        """Use a word: remove it and return its number; None without it."""
        word = self.words.pop(letter, None)
        return None if word is None else word.value

    def fail(self, reason: str) -> NoReturn:
        """Raise ConfigError with file and line."""
        raise ConfigError(self.source, line_key(self.line), reason)


def sorted_block(block: Block, source: Path, *, first: bool) -> SortedBlock:
    """Sort the words of a block; `first`: whether it is the program's first. Raises ConfigError."""
    result = SortedBlock(block.line, source)
    words = block.words[1:] if block.words[0].letter == "N" else block.words
    if first and len(words) == 1 and words[0].letter == "O":
        return result  # the number under which a controller stores the program
    for word in words:
        if word.letter in {"G", "M"}:
            _sort_code(result, word)
        elif word.letter in LETTERS_WITHOUT_EFFECT:
            result.without_effect.append(word)
        elif word.letter == "O":
            result.fail(f"{word.text}: subprograms are not understood; write the program out")
        elif word.letter in result.words:
            result.fail(f"{result.words[word.letter].text} and {word.text} in one block")
        else:
            result.words[word.letter] = word
    return result


def _sort_code(result: SortedBlock, word: Word) -> None:
    name = code_name(word.letter, word.value)
    code = (G_CODES if word.letter == "G" else M_CODES).get(name)
    if code is None:
        result.fail(f"{word.text}: unknown {word.letter} word (docs/part_programs.md lists the known ones)")
    if code.effect is Effect.REFUSED:
        result.fail(f"{word.text}: {code.meaning}")
    if code.group in result.codes:
        result.fail(f"{result.codes[code.group]} and {name} contradict each other in one block")
    result.codes[code.group] = name
    if code.effect is Effect.NONE:
        result.without_effect.append(word)
