"""Which part of which document is generated, and from what; to be regenerated or held against the file."""

import json
import re
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from hil_sim.config import effect_tables
from servo_ctrl.config import key_tables
from studies.compensations.run import markdown
from studies.compensations.twin_study import Row
from studies.feng_2015 import aims, study_tables, temperature_tables, waveform_rests_tables, waveform_tables
from studies.koren_1991 import contour_tables
from studies.wang_2014 import random_table
from studies.xia_fuzzy_pd import random_figures
from tests.campaigns.bench import real_page
from tests.campaigns.pages import claims, dependencies, drive_objects, families, tables

ROOT = Path(__file__).parents[3]
BLIND = tuple(f"docs/blind_families{end}.json" for end in ("", "_training", "_rivals", "_kept_out"))
"""Scored cases, training cases, what rivals said of both, and cases of families that are kept out."""
FRICTION = tuple(
    f"docs/friction_{end}.json" for end in ("study", "drift", "waveforms", "recovery", "rests", "temperature")
)
"""Figures of the study over the bus, production that drifts, waveforms, recovery, rests, and warming."""
POSITIONING, FUZZY_PD = "docs/positioning_random.json", "docs/fuzzy_pd_random.json"


class Generated(NamedTuple):
    """A document with generated text."""

    page: str
    sources: tuple[str, ...]
    """What is read, from the root of the project."""
    filled: Callable[[str], str]
    """The document with its generated text remade, from the document as it is."""


def _figures(source: str) -> Any:
    return json.loads((ROOT / source).read_text(encoding="utf-8"))


def between(document: str, mark: str, text: str) -> str:
    """Return `document` with what stands between `<!-- mark -->` and the next `<!-- end -->` made `text`.

    Raises:
        ValueError: the mark is not there, or more than once.
    """
    pattern = re.compile(rf"(<!-- {re.escape(mark)} -->\n).*?(<!-- end -->)", re.DOTALL)
    filled, count = pattern.subn(lambda found: found[1] + text + found[2], document)
    if count != 1:
        raise ValueError(f"write <!-- {mark} --> once, and <!-- end --> behind it; found {count}")
    return filled


def _compensations(document: str) -> str:
    kept = _figures("docs/compensations.json")["machines"]
    found = {name: {key: Row(**row) for key, row in rows.items()} for name, rows in kept.items()}
    return between(document, "figures", markdown(found))


def _contour_control(document: str) -> str:
    return between(document, "figures", contour_tables.tables(_figures("docs/contour_control.json")))


def _fuzzy_pd(document: str) -> str:
    return between(document, "figures", random_figures.over_tables(_figures(FUZZY_PD)))


def _positioning(document: str) -> str:
    return between(document, "figures", random_table.tables(_figures(POSITIONING)))


def _friction(document: str) -> str:
    study, drift, waveforms, recovery, rests, temperature = (_figures(source) for source in FRICTION)
    positions = aims.at_rest(_figures(POSITIONING), _figures(FUZZY_PD))
    texts = {
        "aims": aims.aims(waveforms, rests, recovery, temperature, study, positions),
        "errors": study_tables.errors(study),
        "reductions": study_tables.reductions(study),
        "learning": study_tables.learning(study),
        "repeated strokes": study_tables.repeated(study),
        "waveforms": waveform_tables.by_motion(waveforms),
        "waveforms on other machines": waveform_tables.by_condition(waveforms),
        "starts behind rests": waveform_rests_tables.by_rest(rests),
        "rivals": waveform_tables.by_rival(waveforms),
        "drift": study_tables.drift(drift),
        "temperature": temperature_tables.by_course(temperature),
    }
    for mark, text in texts.items():
        document = between(document, mark, text)
    return document


def _learning(document: str) -> str:
    return between(document, "learners", study_tables.learners(_figures(FRICTION[0])))


def _families(document: str) -> str:
    scored, training, rivals, kept_out = (_figures(source) for source in BLIND)
    filled = between(document, "figures", families.section(scored, training, rivals["rows"]))
    return between(filled, "kept out", families.kept_out(kept_out, training))


def _measured_axes(_: str) -> str:
    return real_page.page(_figures("docs/reconcile_real.json"))


def _drive_objects(_: str) -> str:
    return drive_objects.page(ROOT / "eds/servo_drive.eds", ROOT / "eds/linear_scale.eds")


def _claims(_: str) -> str:
    listed = tomllib.loads((ROOT / "docs/claims.toml").read_text(encoding="utf-8"))
    return claims.page(claims.read(listed))


def _tables() -> list[Generated]:
    """Return the pages with tables of measured figures, which stand in docs/tables."""
    found = []
    for file in sorted(tables.FOLDER.glob("*.json")):
        source = str(file.relative_to(ROOT))
        kept = _figures(source)
        found.append(Generated(kept["page"], (source,), partial(tables.filled, tables=kept["tables"])))
    return found


def _dependencies(_: str) -> str:
    return dependencies.page(_figures("docs/dependencies.json"))


GENERATED = (
    Generated("docs/blind-trials.md", BLIND, _families),
    Generated("docs/claims.md", ("docs/claims.toml",), _claims),
    Generated("docs/compensations.md", ("docs/compensations.json",), _compensations),
    Generated("docs/contour_control.md", ("docs/contour_control.json",), _contour_control),
    Generated("docs/drive_objects.md", ("eds/servo_drive.eds", "eds/linear_scale.eds"), _drive_objects),
    Generated("docs/dependencies.md", ("docs/dependencies.json", "docs/dependencies.toml"), _dependencies),
    Generated("docs/friction_study.md", (*FRICTION, POSITIONING, FUZZY_PD), _friction),
    Generated("docs/fuzzy_pd.md", (FUZZY_PD,), _fuzzy_pd),
    Generated("docs/learning.md", FRICTION[:1], _learning),
    Generated("docs/machines.md", ("servo_ctrl/config/key_tables.py",), key_tables.filled),
    Generated("docs/plant.md", ("hil_sim/config/effect_tables.py",), effect_tables.filled),
    Generated("docs/positioning_study.md", (POSITIONING,), _positioning),
    Generated("docs/programs.md", ("servo_ctrl/config/key_tables.py",), key_tables.filled),
    Generated("docs/reconcile_real.md", ("docs/reconcile_real.json",), _measured_axes),
    *_tables(),
)
