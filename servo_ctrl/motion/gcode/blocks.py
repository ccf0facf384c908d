"""Splits the text of a part program into blocks of words (ISO 6983, RS-274); anything else is an error.

A word is a letter and a number. Text that is neither word, comment, block delete nor % is an error with its
line, because a dropped word may cause a wrong motion (docs/decisions/0014-g-code-reader.md).
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from servo_ctrl.errors import ConfigError

LARGEST_FILE_BYTES = 50_000_000
"""Bounds a part program, bytes: about a million blocks; chosen."""
LARGEST_NUMBER = 1e9
"""Bounds a number in any unit: beyond any machine, far from floating-point overflow; chosen."""

_ITEM = re.compile(
    r"""[ \t]*(?:
        (?P<letter>[A-Za-z])[ \t]*(?P<number>[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))
        |\([^)]*\)                 # a comment
        |;.*                       # a comment to the end of the line
    )[ \t]*""",
    re.VERBOSE,
)
_BLOCK_DELETE = re.compile(r"[ \t]*/[1-9]?[ \t]*")
_TAPE_MARK = re.compile(r"[ \t]*%[ \t]*(?:\([^)]*\)|;.*)?[ \t]*")


class Word(NamedTuple):
    """A letter, upper case, and its number; `text` is the word as written, without spaces."""

    letter: str
    value: float
    text: str


class Block(NamedTuple):
    """The words of one line; `line` counts from 1, `optional` is block delete (/)."""

    line: int
    words: tuple[Word, ...]
    optional: bool


def line_key(line: int) -> str:
    """Return the name of a line of a part program in messages."""
    return f"line {line}"


def read_text(path: Path) -> str:
    """Read the text of a part program. Comments may be in any 8-bit code. Raises ConfigError."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        raise ConfigError(path, "", "no such file") from None
    except OSError as error:
        raise ConfigError(path, "", f"cannot be read: {error}") from None
    if len(content) > LARGEST_FILE_BYTES:
        raise ConfigError(path, "", f"is larger than {LARGEST_FILE_BYTES // 1_000_000} MB; split it")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def blocks(text: str, source: Path) -> Iterator[Block]:
    """Yield the blocks that have words; a final % is a last block without words. Raises ConfigError."""
    content_seen = False
    for line, content in enumerate(text.split("\n"), 1):
        if _TAPE_MARK.fullmatch(content):
            if content_seen:
                yield Block(line, (), optional=False)
                return
            content_seen = True
            continue
        block = _block(content, line, source)
        if block.words:
            content_seen = True
            yield block


def _block(content: str, line: int, source: Path) -> Block:
    deleted = _BLOCK_DELETE.match(content)
    place = deleted.end() if deleted else 0
    words = []
    while place < len(content):
        item = _ITEM.match(content, place)
        if item is None:
            if not content[place:].strip(" \t"):
                break
            raise ConfigError(source, line_key(line), _reason(content, place))
        letter, number = item["letter"], item["number"]
        if letter is not None:
            value = float(number)
            if not abs(value) < LARGEST_NUMBER:
                raise ConfigError(source, line_key(line), f"{letter}{number[:20]}: the number is too large")
            words.append(Word(letter.upper(), value, letter.upper() + number))
        place = item.end()
    return Block(line, tuple(words), optional=deleted is not None)


def _reason(content: str, place: int) -> str:
    """Return why the text from `place` on is not a word."""
    rest = content[place:].lstrip(" \t")
    if any(sign in rest for sign in "#[]=<>"):
        return f"{rest[:30]!r}: variables and expressions are not understood; write the numbers out"
    if content.lstrip(" \t/").upper().startswith("O"):
        return f"{content.strip()[:30]!r}: subprograms are not understood; write the program out"
    if rest.startswith("("):
        return f"the comment {rest[:30]!r} is not closed"
    if re.match(r"[A-Za-z]", rest):
        return f"{rest[:30]!r}: a number is missing behind {rest[0].upper()}"
    return f"{rest[:30]!r} is not a word; a word is a letter and a number"
