"""The generator is independent of what it tests, and its recordings hold what its truth says."""

import ast
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from reconcile.catalogue.registry import ENTRIES
from reconcile.cli.main import app
from reconcile.errors import ReconcileError
from reconcile.trials.seeds import FIRST_SCORED_SEED
from tests.campaigns.blind import claim, draw, record
from tests.campaigns.blind.axis.record import AT
from tests.campaigns.blind.case import Planted, SimulatedRecording
from tests.campaigns.blind.contributions import known_force_n
from tests.campaigns.blind.draws import SHARES
from tests.campaigns.blind.effects import CATALOGUE
from tests.campaigns.blind.foreign import FOREIGN
from tests.campaigns.blind.nominal import smooth
from tests.campaigns.blind.observability import clutter
from tests.campaigns.blind.recorded import simulated

HERE = Path(__file__).parent
ALLOWED = {"numpy", "numba", "scipy", "pyarrow", *sys.stdlib_module_names}


def imported(file: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file.name}: relative import"
            names.add(node.module or "")
    return names


@pytest.mark.parametrize("file", sorted(HERE.glob("[!t]*.py")), ids=lambda file: file.name)
def test_the_generator_imports_nothing_of_what_it_tests(file: Path) -> None:
    strangers = {
        name
        for name in imported(file)
        if not name.startswith("tests.campaigns.blind") and name.split(".")[0] not in ALLOWED
    }
    assert not strangers


def test_every_entry_of_the_catalogue_is_drawn() -> None:
    of_rotary_and_geared_axes = {
        "gravity",
        "gravity_of_outer_link",
        "joint_coupling",
        "load_dependent_friction",
    }  # this generator has screws and linear motors
    assert {*ENTRIES} - {"payload_mass"} - of_rotary_and_geared_axes <= {*CATALOGUE}


def test_a_seed_is_a_case_and_kinds_come_in_their_shares() -> None:
    cases = [draw(seed) for seed in range(300)]
    assert cases[17] == draw(17)
    for kind, share in SHARES.items():
        assert abs(sum(case.kind == kind for case in cases) / 300 - share) < 0.09
    assert any(case.production for case in cases)
    assert any(not case.sensing.has_scale for case in cases)


def test_the_same_seed_makes_the_same_files(tmp_path: Path) -> None:
    case = draw(54)  # two short recordings
    first, second = record(case, tmp_path / "a"), record(case, tmp_path / "b")
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    truth = json.loads((tmp_path / "a" / "sealed" / "truth.json").read_text(encoding="utf-8"))
    assert [effect["name"] for effect in truth["effects"]] == [effect.name for effect in case.planted]


def balance(name: str, seed: int) -> tuple[float, float]:
    """RMS in N of the recorded force less Newton's law, and less the sealed contributions too."""
    case = draw(seed, names=(name,))
    recordings: list[SimulatedRecording] = [simulated(case, run) for run in case.runs]
    left = clutter_free = 0.0
    for one in recordings:
        own = {key.removeprefix("x."): values for key, values in one.columns.items()}
        known = known_force_n(case, one.inside)
        direction = np.sign(one.inside[:, AT["velocity_m_s"]])
        p = case.plant
        left_n = np.zeros((2, len(known)))
        for row, taken in enumerate((np.zeros_like(known), known)):
            _, v, a, force = smooth(own["time_s"], own["motor_position_m"], own["motor_force_n"] - taken)
            rubbed = smooth(own["time_s"], one.inside[:, 0], p.coulomb_n * direction)[3]
            left_n[row] = force - (p.motor_kg + p.table_kg) * a - p.viscous_n_s_m * v - rubbed
        moving = np.abs(v) > 0.02 * np.abs(v).max()
        moving[:500] = moving[-500:] = False
        left += float(np.sum(left_n[0][moving] ** 2))
        clutter_free += float(np.sum(left_n[1][moving] ** 2))
    return left, clutter_free


@pytest.mark.parametrize(
    "name",
    ["stribeck_friction", "position_dependent_force", "cogging", "periodic_disturbance", "constant_force"],
)
def test_what_is_concealed_is_written_down_to_the_newton(name: str) -> None:
    before, after = balance(name, 40)
    assert after < 0.2 * before


@pytest.mark.parametrize("name", sorted(FOREIGN))
def test_physics_outside_the_catalogue_is_labelled_as_outside(name: str) -> None:
    case = draw(3, names=(name,), kind="foreign")
    assert isinstance(case.planted[0], Planted)
    assert not case.planted[0].catalogue
    assert name not in CATALOGUE


def test_clutter_is_there_and_smaller_than_the_friction() -> None:
    case = draw(8, kind="none", names=())
    sizes = clutter(case, [simulated(case, run) for run in case.runs])
    assert 0.0 < sizes["presliding_hysteresis"] < case.plant.coulomb_n
    assert 0.0 < sizes["cogging"] < 0.1 * case.plant.coulomb_n


def test_seeds_that_were_scored_are_refused_and_fresh_ones_named() -> None:
    result = CliRunner().invoke(app, ["trial", "--seed", "100590", "--cases", "20"])
    assert isinstance(result.exception, ReconcileError)
    assert "seeds 100000 to 100599 are used; begin at 100600" in str(result.exception)
    assert str(FIRST_SCORED_SEED) in CliRunner().invoke(app, ["trial", "--help"]).output
    assert not claim(0, 100)
