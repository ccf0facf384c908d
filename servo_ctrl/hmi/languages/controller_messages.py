"""Messages of the controller in the language of the page: events, reasons and refusals.

The controller writes English to its log, its recordings and every client; the page gets finished texts.
The catalogue `controller.de.toml` maps the templates of the code to German; a text is recognised by its
template, its arguments are translated likewise, and put into the German template. A text without a template
stays English. tests/unit/servo_hmi/test_language.py finds templates that a catalogue lacks.
"""

import re
from collections.abc import Mapping
from functools import cache, lru_cache
from typing import NamedTuple

from servo_ctrl.hmi.languages.texts import ENGLISH, CurrentLanguage, catalogue

DEEPEST = 6
"""Bounds how far a message that a node had a part in is taken to pieces; ours have three levels."""
LONGEST = 2000
"""Longer texts are shown as they came; ours have some 300 characters."""
KEPT = 2000
"""Translations that are kept: pages ask for the same ones five times a second."""
_PLACE = re.compile(r"\{(\d)\}")
_MICROMETRES = re.compile(r"(?<=\d )um\b")


class _Template(NamedTuple):
    pattern: re.Pattern[str]
    german: str
    """With {0}, {1} ... as in the English one, in any order."""


def controller_text(text: str, language: str | None = None) -> str:
    """A message of the controller in a language, else that of the page, with the signs of its units."""
    shown = _translated(text, language or CurrentLanguage.find())
    return _MICROMETRES.sub("\N{MICRO SIGN}m", shown).replace("/s^2", "/s\N{SUPERSCRIPT TWO}")


def controller_catalogue(language: str) -> Mapping[str, str]:
    """The templates and words of a language by their English ones; none for English itself."""
    return catalogue(language, "controller.")


@cache
def _templates(language: str) -> list[_Template]:
    """The templates, those with the most text of their own first: they say the most exactly what is meant."""
    entries = controller_catalogue(language).items()
    ordered = sorted(entries, key=lambda entry: -len(_PLACE.sub("", entry[0])))
    return [_Template(re.compile(_pattern(english), re.DOTALL), shown) for english, shown in ordered]


def _pattern(english: str) -> str:
    parts = re.split(r"\{\d\}", english)
    return "(.*?)".join(re.escape(part) for part in parts)


@lru_cache(KEPT)
def _translated(text: str, language: str) -> str:
    return _piece(text, language, DEEPEST) if language != ENGLISH and len(text) <= LONGEST else text


def _piece(text: str, language: str, depth: int) -> str:
    """A text by its template; else its parts before and after a semicolon or a colon, each by its own."""
    if not depth or not text:
        return text
    for template in _templates(language):
        found = template.pattern.fullmatch(text)
        if found is not None:
            return template.german.format(*(_piece(part, language, depth - 1) for part in found.groups()))
    for sign in ("; ", ": ", ", "):
        before, _, after = text.partition(sign)
        if after:
            return sign.join(_piece(part, language, depth - 1) for part in (before, after))
    return text
