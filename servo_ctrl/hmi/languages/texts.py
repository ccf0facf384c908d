"""The languages of the pages: English texts in the code, a folder of catalogue files for each other language.

A text is written in English where it is shown, as `tr("Axis {axis}", axis=name)`; a constant that is shown
elsewhere is marked by `word("Standby")` and translated there. The files of the folder `de/pages` map each
English text to German. tests/unit/servo_hmi/test_language.py finds texts that are in no file, and entries
that no code uses. Another language is another folder and a line in LANGUAGES.
"""

import re
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import TypeVar, overload

Key = TypeVar("Key")
ENGLISH = "en"
LANGUAGES = {ENGLISH: "English", "de": "Deutsch"}
"""By their code (ISO 639-1): the name in the language itself."""
LANGUAGE_COOKIE = "bench_language"
CATALOGUES = Path(__file__).parent
_QUALITY = re.compile(r"q=([01](\.\d{1,3})?)")


class CurrentLanguage:
    """The language of the page for which code runs; the process that serves pages sets how to find it."""

    find: Callable[[], str] = staticmethod(lambda: ENGLISH)


@cache
def catalogue(language: str, part: str = "pages") -> Mapping[str, str]:
    """Return the texts of a language by their English ones; none for English itself.

    `part` is a folder of its files: "pages", or "controller" for what the machine and its files say.
    """
    if language == ENGLISH:
        return {}
    files = sorted((CATALOGUES / language / part).glob("*.toml"))
    sections = [section for file in files for section in tomllib.loads(file.read_text("utf-8")).values()]
    return {english: text for section in sections for english, text in section.items()}


def word(text: str) -> str:
    """Mark a constant for the catalogues; the code that shows it translates it by `tr`."""
    return text


def tr(text: str, /, **values: object) -> str:
    """Return the text in the language of the page, with these values at its {placeholders}."""
    shown = catalogue(CurrentLanguage.find()).get(text, text)
    return shown.format(**values) if values else shown


@overload
def translated(texts: Mapping[Key, str]) -> dict[Key, str]: ...
@overload
def translated(texts: tuple[str, ...]) -> tuple[str, ...]: ...
def translated(texts: Mapping[Key, str] | tuple[str, ...]) -> dict[Key, str] | tuple[str, ...]:
    """Return constants that were marked by `word`, in the language of the page."""
    if isinstance(texts, tuple):
        return tuple(tr(text) for text in texts)
    return {key: tr(text) for key, text in texts.items()}


def chosen_language(cookie: str | None, accepted: str, default: str | None) -> str:
    """Return the language of a visitor.

    That of the cookie, in which a choice on the page is kept; else `default`, the option of whoever started
    the page; else the first known one of the header Accept-Language.
    """
    if cookie in LANGUAGES:
        return cookie
    if default in LANGUAGES:
        return default
    preferences = []
    for place, preference in enumerate(accepted.split(",")[:20]):
        code, _, parameter = preference.strip().partition(";")
        quality = _QUALITY.fullmatch(parameter.strip())
        preferences.append((-float(quality[1]) if quality else -1.0, place, code.partition("-")[0].lower()))
    return next((code for quality, _, code in sorted(preferences) if quality and code in LANGUAGES), ENGLISH)
