"""The report of a diagnosis in German: all that a reader sees, and neither more nor less than that."""

import html
import json
import re
from pathlib import Path

import pytest
from report_examples import HOSTILE

from servo_ctrl.hmi.languages.report_page import translated_report, translated_text

SAME = {"x", "RMS", "model.toml", "in", "nominal", "Position", "Amplitude", "Parameter", HOSTILE}
WORD = re.compile(r"[A-Za-z]{4,}")
KEPT = re.compile(r'<(\w+)[^<>]* translate="no"[^<>]*>.*?</\1>', re.DOTALL)
"""What reconcile marks so that it stays as it is."""


def body(page: str) -> str:
    return page[page.index("<main>") : page.index('<script type="application/json"')]


def shown(page: str) -> list[str]:
    """The texts between tags, without what stays English."""
    return [html.unescape(text).strip() for text in re.findall(">([^<>]+)(?=<)", KEPT.sub("", body(page)))]


@pytest.fixture(scope="module")
def both(report: Path) -> tuple[str, str]:
    english = report.read_text(encoding="utf-8")
    return english, translated_report(english, "de")


def test_headings_verdict_and_heads_of_tables_are_german(both: tuple[str, str]) -> None:
    texts = shown(both[1])
    for text in (
        "Urteil: Effekte",
        "Das Modell lässt einen Effekt aus: Rastmoment auf Achse x.",
        "Was das Modell auslässt",
        "Wert (95-%-Intervall)",
        "Nachfahren im geschlossenen Regelkreis",
        "Achse x: Motorkraft",
        "angepasste Blöcke: nominal",
        "mit Effekten",
    ):
        assert text in texts
    assert both[1].startswith('<!doctype html><html lang="de">')


def test_no_text_of_the_report_stays_english(both: tuple[str, str]) -> None:
    before, after = map(shown, both)
    assert len(before) == len(after) > 80
    same = {one.replace(HOSTILE, "") for one, other in zip(before, after, strict=True) if one == other}
    assert not {text for text in same - SAME if WORD.search(text)}


def test_file_names_stay_as_reconcile_wrote_them(both: tuple[str, str]) -> None:
    english, german = ([match[0] for match in KEPT.finditer(body(page))] for page in both)
    assert english == german
    assert english


def test_titles_of_figures_are_german_and_their_numbers_are_the_same(both: tuple[str, str]) -> None:
    english, german = (
        json.loads(re.search(r'id="figures">(.*?)</script>', page, re.DOTALL)[1])  # type: ignore[index]
        for page in both
    )
    assert english.keys() == german.keys()
    titles = {one["layout"]["xaxis"]["title"]["text"] for one in german.values()}
    assert {"Zeit (s)", "Frequenz (Hz)"} <= titles
    names = {trace["name"] for one in german.values() for trace in one["data"]}
    assert {"nominales Modell", "mit den Effekten", "Rauschen", "aufgezeichnet"} <= names
    for name, one in english.items():
        for trace, other in zip(one["data"], german[name]["data"], strict=True):
            assert trace["y"] == other["y"]
    assert both[1].count("<script") == both[0].count("<script"), "no text has become an element"


def test_another_page_and_english_stay_as_they_are(both: tuple[str, str]) -> None:
    assert translated_report(both[0], "en") == both[0]
    assert translated_report("<p>no report</p>", "de") == "<p>no report</p>"


def test_sentences_are_recognised_one_by_one() -> None:
    text = "Look at it over the run time. Something else. Over time"
    assert translated_text(text, "de") == "Zu sehen ist es über: die Laufzeit. Something else. Über der Zeit"
