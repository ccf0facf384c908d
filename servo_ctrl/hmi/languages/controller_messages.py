"""Messages of the controller and of reconcile in the language of the page.

The controller writes English events, reasons and refusals to its log, its recordings and every client; the
page gets finished texts. So it does from the loaders of its files, and from reconcile. The files in
`de/controller` and `de/diagnosis` map the templates of their code to German; a text is recognised by its
template, its arguments are translated likewise, and put into the German template. A text without a template
stays English. `report_page` does so with the report of a diagnosis, whose templates are in `de/report`.
tests/unit/servo_hmi/test_language.py finds templates that a catalogue lacks.
"""

import re
from functools import cache, lru_cache
from itertools import islice
from typing import NamedTuple

from servo_ctrl.hmi.languages.texts import ENGLISH, CurrentLanguage, catalogue
from servo_ctrl.units import with_signs

DEEPEST = 6
"""Bounds the levels to which a message with the text of a node is divided; ours have three."""
LONGEST = 2000
"""Bounds the characters of a text that is translated; chosen: the longest message has about 300."""
KEPT = 2000
"""Bounds the cached translations; chosen: pages ask for the same ones five times a second."""
PARTS_OF = {"report": ("report", "diagnosis")}
"""The folders of a part that has those of another one, too."""
SIGNS = {"; ": 1, ": ": 1, ", ": 20}
"""Where a text without a template is divided, and how often: a list has many commas."""
SENTENCE = 20
"""Characters of a template that is a sentence, which no other text resembles by chance; chosen."""
_NEXT_SENTENCE = re.compile(r"\. [A-Z`]")
_PLACE = re.compile(r"\{(\d)\}")


class _Template(NamedTuple):
    own: tuple[str, ...]
    """Its own text between the arguments: what lacks a piece of it is not matched, which takes long."""
    pattern: re.Pattern[str]
    german: str
    """With {0}, {1} ... as in the English one, in any order."""


def controller_text(text: str, language: str | None = None) -> str:
    """Return a controller's message in a language, else that of the page, with the signs of its units."""
    return _shown(text, language, "controller")


def diagnosis_text(text: str) -> str:
    """Return a text of reconcile, such as the explanation of a finding, in the language of the page."""
    return _shown(text, None, "diagnosis")


def report_text(text: str, language: str) -> str:
    """Return a sentence, heading or name of a diagnosis report in a language, also if capitalized."""
    return whole_sentence(text, language) or _translated(text, language, "report")


def whole_sentence(text: str, language: str) -> str | None:
    """Return the translation by one long template that matches the whole text; None without one."""
    if len(text) > LONGEST:
        return None
    whole = _by_template(text, language, "report", DEEPEST, SENTENCE)
    if whole is None:
        small = text[:1].lower() + text[1:]
        whole = _by_template(small, language, "report", DEEPEST, SENTENCE)
        whole = whole[:1].upper() + whole[1:] if whole is not None else None
    return whole


def _shown(text: str, language: str | None, part: str) -> str:
    return with_signs(_translated(text, language or CurrentLanguage.find(), part))


@cache
def _templates(language: str, part: str) -> list[_Template]:
    """Return the templates, those with the most text of their own first: they are the most specific."""
    entries = [entry for one in PARTS_OF.get(part, (part,)) for entry in catalogue(language, one).items()]
    ordered = sorted(entries, key=lambda entry: -len(_PLACE.sub("", entry[0])))
    return [
        _Template(tuple(_PLACE.split(english)[::2]), re.compile(_pattern(english), re.DOTALL), shown)
        for english, shown in ordered
    ]


def _pattern(english: str) -> str:
    parts = re.split(r"\{\d\}", english)
    return "(.*?)".join(re.escape(part) for part in parts)


@lru_cache(KEPT)
def _translated(text: str, language: str, part: str) -> str:
    return _piece(text, language, part, DEEPEST) if language != ENGLISH and len(text) <= LONGEST else text


def _piece(text: str, language: str, part: str, depth: int) -> str:
    """Translate a text by its template; else in two parts, at a colon before a template or at a sign."""
    if not depth or not text:
        return text
    whole = _by_template(text, language, part, depth)
    if whole is not None:
        return whole
    small = text[0].lower() + text[1:]
    if small != text and (whole := _by_template(small, language, part, depth)) is not None:
        return whole[:1].upper() + whole[1:]
    # a file, a line and a key stand before the reason
    for colon in islice(re.finditer(": ", text), DEEPEST):
        reason = _by_template(text[colon.end() :], language, part, depth)
        if reason is not None:
            return f"{_piece(text[: colon.start()], language, part, depth - 1)}: {reason}"
    for sign, most in SIGNS.items():
        pieces = text.split(sign, most)
        if pieces[1:]:
            return sign.join(_piece(one, language, part, depth - 1) for one in pieces)
    return text


def _by_template(text: str, language: str, part: str, depth: int, least: int = 0) -> str | None:
    """Return the translation by the template that matches the whole text with its arguments, else None.

    `least`: characters of its own that the template has at least.
    """
    for template in _templates(language, part):
        if sum(map(len, template.own)) < least:
            return None
        if not all(piece in text for piece in template.own):
            continue
        found = template.pattern.fullmatch(text)
        if found is not None and all(_is_argument(one, least, template.own) for one in found.groups()):
            return template.german.format(*(_piece(one, language, part, depth - 1) for one in found.groups()))
    return None


def _is_argument(text: str, least: int, own: tuple[str, ...]) -> bool:
    """Whether a text may stand for an argument of a template with this text of its own.

    Its parentheses are whole, it is not a second sentence, and in a short template no second clause.
    """
    if sum(map(len, own)) < SENTENCE and ("; " in text or (": " in text and ":" not in "".join(own))):
        return False
    depth = 0
    for sign in text:
        depth += (sign == "(") - (sign == ")")
        if depth < 0:
            return False
    return depth == 0 and not (least and _NEXT_SENTENCE.search(text))
