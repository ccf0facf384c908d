"""The families are independent of the product and of each other; cases are drawn, written and scored."""

import ast
import importlib
import json
import re
import sys
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.campaigns.blind.families import grammar, seeds
from tests.campaigns.blind.families.files import record
from tests.campaigns.blind.families.interface import SHARES, Channels, plan
from tests.campaigns.blind.families.merge import merged
from tests.campaigns.blind.families.score import scored, summary

HERE = Path(__file__).parent
OWN = "tests.campaigns.blind.families"
ALLOWED = {"numpy", "scipy", "numba", "pyarrow", *sys.stdlib_module_names}
LONG_LINE = 28
"""Characters beside names of effects from which on a line says something."""
EVERY = (*seeds.FAMILIES, *seeds.KEPT_OUT)
OF_FAMILIES = {"numpy", "scipy", "numba", "math", "typing", "collections"}


def sources(family: str) -> list[Path]:
    return [file for file in sorted((HERE / family).glob("*.py")) if not file.name.startswith("test_")]


def imported(file: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@pytest.mark.parametrize("family", EVERY)
def test_a_family_imports_itself_the_interface_and_mathematics(family: str) -> None:
    strangers = {
        name
        for file in sources(family)
        for name in imported(file)
        if not name.startswith((f"{OWN}.{family}", f"{OWN}.interface."))
        and name.split(".")[0] not in OF_FAMILIES
    }
    assert not strangers


def test_what_the_families_share_imports_nothing_of_the_product() -> None:
    for file in HERE.glob("*.py"):
        if file.name.startswith("test_"):
            continue
        assert all(name.startswith(OWN) or name.split(".")[0] in ALLOWED for name in imported(file)), file


def test_no_function_body_and_no_line_is_equal_between_families() -> None:
    owners: dict[str, set[str]] = defaultdict(set)
    for family in EVERY:
        for file in sources(family):
            text = file.read_text(encoding="utf-8")
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.FunctionDef):
                    own = node.body[1:] if ast.get_docstring(node) else node.body
                    owners["\n".join(map(ast.dump, own))].add(family)
            for line in map(str.strip, text.splitlines()):
                # what the interface asks for, and names of effects that exclude or stand for each other
                if not line.startswith(("from ", "import ", "def draw(", "def simulate(", '"""')):
                    spoken = re.sub(r'"[a-z_]+"|frozenset', "", line)
                    owners[line].update({family} if len(spoken) > LONG_LINE else ())
    assert [text for text, families in owners.items() if len(families) > 1] == []


@pytest.mark.parametrize("family", EVERY)
def test_a_case_is_written_with_its_truth_and_the_same_seed_writes_the_same(
    family: str, tmp_path: Path
) -> None:
    draw = importlib.import_module(f"{OWN}.{family}").draw
    paths, seal = record(draw(5, "single"), tmp_path / "a")
    truth = json.loads((tmp_path / "a" / "sealed" / "truth.json").read_text(encoding="utf-8"))
    assert 2 <= len(paths) <= 4
    assert [effect["name"] for effect in truth["effects"]] == sorted(draw(5, "single").names)
    assert (tmp_path / "a" / "model.toml").read_text(encoding="utf-8").startswith("[axis.")
    for path in paths:
        if path.suffix == ".parquet":
            columns = pq.read_table(path).to_pydict()
            assert all(np.isfinite(values).all() for values in columns.values())
            assert 9.9 <= columns["time_s"][-1] <= 25.0
    assert record(draw(5, "single"), tmp_path / "b")[1] == seal


@pytest.mark.parametrize("family", EVERY)
def test_a_loop_follows_its_motion_whatever_is_concealed(family: str) -> None:
    draw = importlib.import_module(f"{OWN}.{family}").draw
    for seed in (11, 23):
        case = draw(seed)
        for one in case.simulate(case.names, False, None):
            assert np.abs(one["motor"] - one["command"]).max() < 0.15 * np.ptp(one["command"])


def test_kinds_come_in_their_shares_and_conflicts_never() -> None:
    rng, conflict = np.random.default_rng(5), frozenset({"a", "b"})
    plans = [plan(rng, ["a", "b", "c", "d"], [conflict]) for _ in range(2000)]
    for kind, share in SHARES.items():
        assert abs(sum(drawn == kind for drawn, _ in plans) / 2000 - share) < 0.04
    assert not any(conflict <= {*names} for _, names in plans)
    with pytest.raises(ValueError, match="quiet, single"):
        plan(rng, ["a"], [], "loud")


def coordinates(n: int = 4000) -> Channels:
    t = np.arange(n) * 1e-3
    x, v = np.sin(2.0 * t), np.cos(2.0 * t)
    names = {"position": x, "velocity": v, "acceleration": -x, "force": 0.5 * v - 0.5 * x, "time": t / t[-1]}
    return names | {"temperature": np.zeros(n), "seconds": t}


def test_foreign_physics_is_never_one_coordinate_without_memory() -> None:
    runs = [coordinates(), coordinates(3000)]
    for seed in range(10):
        expression = grammar.draw(np.random.default_rng(seed), runs)
        assert all(map(grammar._is_foreign, expression[1:]))
        assert json.loads(json.dumps(expression)) == expression
        assert np.isfinite(grammar.evaluate(expression, runs[0], 0)).all()


def test_an_event_of_one_recording_is_in_no_other_and_a_play_lags_by_half_its_width() -> None:
    run = coordinates()
    event = ["product", ["velocity"], ["step", 1, 2.0]]
    assert not grammar.evaluate(event, run, 0).any()
    inside = grammar.evaluate(event, run, 1)
    np.testing.assert_array_equal(inside[2000:], run["velocity"][2000:])
    assert not inside[:2000].any()
    play = grammar.evaluate(["play", 0.4, ["position"]], run, 0)
    assert np.abs(play - run["position"]).max() == pytest.approx(0.2, abs=1e-9)
    lag = grammar.evaluate(["lag", 0.3, ["step", -1, 1.0]], run, 0)
    assert lag[1299] == pytest.approx(1.0 - np.exp(-1.0), abs=1e-3)


def test_a_seed_is_scored_once(tmp_path: Path) -> None:
    file = tmp_path / "used.json"
    file.write_text("{}", encoding="utf-8")
    assert not seeds.claim("belt_drive", 0, 20, file)
    assert seeds.claim("belt_drive", 10_000, 20, file)
    with pytest.raises(ValueError, match="begin at 10020"):
        seeds.claim("belt_drive", 10_019, 5, file)
    with pytest.raises(ValueError, match="both sorts"):
        seeds.claim("belt_drive", 9_999, 2, file)
    assert seeds.claim("ball_screw", 10_000, 1, file)
    assert seeds.first_fresh("belt_drive", file) == 10_020


def test_trials_side_by_side_lose_no_seed_and_read_no_half_file(tmp_path: Path) -> None:
    file = tmp_path / "used.json"
    file.write_text("{}", encoding="utf-8")

    def claim_some(family: str) -> None:
        for first in range(10_000, 10_020):
            assert seeds.first_fresh(family, file) == first
            seeds.claim(family, first, 1, file)

    with ThreadPoolExecutor() as trials:
        list(trials.map(claim_some, seeds.FAMILIES))
    assert all(seeds.first_fresh(family, file) == 10_020 for family in seeds.FAMILIES)


def test_a_family_that_is_kept_out_is_in_no_merged_table() -> None:
    run = {"scored": True, "rows": [{"family": family, "seed": 10_000} for family in seeds.FAMILIES]}
    assert len(merged([run], "1")["rows"]) == len(seeds.FAMILIES)
    kept_out = {"scored": True, "rows": [{"family": seeds.KEPT_OUT[0], "seed": 10_000}]}
    with pytest.raises(ValueError, match="tilting_table does not belong here: nothing is fitted on it"):
        merged([run, kept_out], "1")
    assert len(merged([kept_out], "1", kept_out=True)["rows"]) == 1
    with pytest.raises(ValueError, match="does not belong here: it is fitted on"):
        merged([run], "1", kept_out=True)


def test_scores_by_hand() -> None:
    def effect(name: str, *, observable: bool = True) -> dict[str, object]:
        shown = {"name": name, "parameters": {"force_n": 5.0}, "also": [], "alike": ["twin"]}
        return shown | {"observable": observable}

    def finding(name: str, low: float, high: float) -> dict[str, object]:
        stated = {"force_nm": {"value": 0.0, "ci95": [low, high]}}
        return {"effect": name, "equivalent": [], "confidence": 0.9, "parameters": stated}

    outside = {"rms": 2.0, "observable": True}
    truth = {"family": "f", "seed": 1, "kind": "beside", "clutter": ["small"], "foreign": outside}
    truth["effects"] = [effect("a"), effect("b", observable=False)]
    verdict = {
        "verdict": "unknown",
        "findings": [finding("a", 4.0, 4.5), finding("small", 0, 1), finding("z", 0, 1)],
    }
    verdict["accounted"] = {"x": {"force": {"parts": {"unexplained": {"rms": 2.9}}}}}
    row = scored(truth, verdict)
    assert row["right"] == {"a": True}
    assert row["false"] == ["z"]
    assert row["covered"] == {"a.force_n": False}
    assert row["unknown"]
    assert row["unexplained"]["within"]
    figures = summary([row, {"family": "f", "kind": "single", "error": "none"}])["f"]
    assert figures["failed"] == {"share": 0.5, "of": 2}
    assert figures["right_of_single"] == {"share": None, "of": 0}
    assert figures["unknown_of_foreign"] == {"share": 1.0, "of": 1}
    assert figures["false_names_beside_true"] == {"share": 1.0, "of": 1}
