"""The report of a diagnosis in the language of its reader.

reconcile writes one HTML file, in English. What a reader sees of it is the text between its tags, and titles
and names in the data of its figures; each is recognised by the templates of `de/report` and `de/diagnosis`.
Elements that reconcile marks with translate="no" stay as they are.
"""

import html
import json
import re
from functools import partial
from typing import Any

from servo_ctrl.hmi.languages.controller_messages import report_text, whole_sentence
from servo_ctrl.hmi.languages.texts import ENGLISH, CurrentLanguage
from servo_ctrl.units import with_signs

_SENTENCE_END = re.compile(r"\. (?=[A-Z`])")
_AROUND = " \n.:;"
"""What stands around a text without being part of its template."""
_KEPT = r'<(\w+)[^<>]* translate="no"[^<>]*>.*?</\1>'
_VISIBLE = re.compile(rf"{_KEPT}|>([^<>]+)(?=<)", re.DOTALL)
"""An element that stays as it is, or a text between two tags."""
_FIGURES = '<script type="application/json" id="figures">'
_SHOWN_KEYS = {"name", "text", "hovertemplate"}
"""Keys of a figure whose values a reader sees."""


def translated_report(page: str, language: str) -> str:
    """Return the file in another language; what is not recognised stays English."""
    begin, data = page.find("<main>"), page.find(_FIGURES)
    end = page.find("</script>", data)
    if language == ENGLISH or min(begin, data, end) < 0:
        return page
    head = page[:begin].replace('<html lang="en">', f'<html lang="{language}">', 1)
    body = _VISIBLE.sub(partial(_translated, language), page[begin:data])
    figures = json.loads(page[data + len(_FIGURES) : end])
    shown = json.dumps(_figure(figures, language), allow_nan=False).replace("<", "\\u003c")
    return f"{head}{body}{_FIGURES}{shown}{page[end:]}"


def translated_text(text: str, language: str) -> str:
    """Return the sentences of a text in another language, each by its template, or several by one."""
    core = text.strip(_AROUND)
    if not core:
        return text
    sentences, shown = _SENTENCE_END.split(core), []
    while sentences:
        for count in range(len(sentences), 0, -1):
            whole = whole_sentence(". ".join(sentences[:count]), language)
            if whole is not None:
                break
        shown.append(report_text(sentences[0], language) if whole is None else whole)
        del sentences[:count]
    before, _, after = text.partition(core)
    return f"{before}{'. '.join(shown)}{after}"


def note_text(text: str) -> str:
    """Return a note of a diagnosis, such as on its model, in the language of the page."""
    language = CurrentLanguage.find()
    return with_signs(text if language == ENGLISH else translated_text(text, language))


def _translated(language: str, match: re.Match[str]) -> str:
    text = match[2]
    if text is None:
        return match[0]
    return f">{html.escape(translated_text(html.unescape(text), language))}"


def _figure(value: Any, language: str) -> Any:
    """Return the data of figures with the texts of their titles, names and marks translated."""
    if isinstance(value, list):
        return [_figure(one, language) for one in value]
    if not isinstance(value, dict):
        return value
    return {
        key: report_text(one, language)
        if key in _SHOWN_KEYS and isinstance(one, str)
        else _figure(one, language)
        for key, one in value.items()
    }
