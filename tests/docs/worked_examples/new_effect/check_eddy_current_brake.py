"""Runs in a copy of the tree that has the eddy-current brake; see docs/development.md."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_findings import BASE, FORCE, data, model_file

from hil_sim.config import load_plant
from hil_sim.config.build import fill_axis
from hil_sim.config.effect_tables import filled
from hil_sim.physics.friction import eddy_current_brake
from hil_sim.plant.layout import AXIS_PARAMS, AXIS_STATE
from hil_sim.plant.presence import presence_of
from hil_sim.plant.sliding import slide
from reconcile.catalogue.registry import CATALOGUE, confused_with, distinguishing_observation
from reconcile.nominal_model.model_file import load_model
from reconcile.nominal_model.model_terms import terms_of_model

ROOT = Path.cwd()
SECTION = "[axis.x.eddy_current_brake]\npeak_n = 40.0\ncritical_mm_s = 80.0\n"


def _pushed(folder: Path, section: str) -> float:
    """Speed of the x axis after 20 ms under 100 N, m/s; its kernels run uncompiled on these records."""
    table = ROOT / "machines" / "xy_table" / "plant.toml"
    text = table.read_text(encoding="utf-8").replace('eds = "', f'eds = "{table.parent}/')
    file = folder / "plant.toml"
    file.write_text(text + "\n" + section, encoding="utf-8")
    config = load_plant(file)
    p, s = (np.zeros(1, dtype).view(np.recarray)[0] for dtype in (AXIS_PARAMS, AXIS_STATE))
    fill_axis(p, config.axes["x"])
    velocity_m_s = 0.0
    for _ in range(400):
        velocity_m_s = slide(p, s, presence_of(p).friction, 50.0, velocity_m_s, 100.0, config.dt_s)
    return velocity_m_s


def test_the_section_brakes_the_axis(tmp_path: Path) -> None:
    free_m_s = _pushed(tmp_path, "")
    assert 0.0 < _pushed(tmp_path, SECTION) < 0.99 * free_m_s


def test_the_force_has_its_peak_at_the_critical_speed() -> None:
    p = eddy_current_brake.Params(peak_n=40.0, critical_m_s=0.08)

    def force_n(speed_m_s: float) -> Any:
        return eddy_current_brake.damping_n_s_m(p, speed_m_s) * speed_m_s

    assert force_n(0.08) == pytest.approx(40.0)
    assert max(force_n(0.06), force_n(0.1)) < 40.0


def test_a_model_with_the_section_is_read_as_the_term_that_predicts_its_force(tmp_path: Path) -> None:
    file = model_file(tmp_path, extra=SECTION)
    model = load_model(file)
    seen = data(tmp_path)
    [term] = terms_of_model(model.axes["x"], [seen])
    entry = CATALOGUE[term.effect]
    family = entry.family(FORCE)
    assert family is not None
    predicted_n = family.columns(seen, term.shape_parameters) @ np.array(term.coefficients)
    p = eddy_current_brake.Params(peak_n=40.0, critical_m_s=0.08)
    law_n = [eddy_current_brake.damping_n_s_m(p, v) * v for v in seen.motion.velocity_m_s]
    assert predicted_n == pytest.approx(np.array(law_n))
    assert (
        BASE["coulomb_n"]
        < entry.parameters(term.shape_parameters, np.array(term.coefficients))["peak_n"].value
    )


def test_its_rival_knows_it_and_the_docs_have_its_table() -> None:
    assert "eddy_current_brake" in confused_with("quadratic_viscous_friction")
    assert "critical speed" in distinguishing_observation("quadratic_viscous_friction", "eddy_current_brake")
    document = (ROOT / "docs" / "plant.md").read_text(encoding="utf-8")
    assert filled(document) == document
