"""A fleet from its files to the table: no task runs twice, and no error ends the run."""

import json
import os
import tomllib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import fleet_stubs
import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

from hil_sim.config import load_plant
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.fleet.cluster import TaskOutcome
from reconcile.fleet.fleet import FleetOptions, FleetPlan, diagnose_fleet, plan_fleet, write_results
from reconcile.fleet.limit import TimeLimitError, run_with_time_limit
from reconcile.fleet.rows import Row
from reconcile.fleet.task import diagnose_axis
from reconcile.formats.mapping import parse_mapping

MODEL = """
[axis.any]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
viscous_friction.viscous_n_s_m = 100.0
coulomb_friction.coulomb_n = 12.0
"""
OPTIONS = FleetOptions()


class Here:
    """The interface of a cluster without processes: tasks run at once."""

    def run(self, work: Callable[[Any], Any], tasks: Iterable[Any], limit_s: float) -> Iterator[TaskOutcome]:
        for task in tasks:
            try:
                yield TaskOutcome(
                    task, run_with_time_limit(lambda task=task: work(task), limit_s, lambda: None, 1.0)
                )
            except TimeLimitError as error:
                yield TaskOutcome(task, None, "over time", str(error))


def record(path: Path, seed: int, cogging_n: float) -> None:
    """Write eight seconds of oscillation; forces by Newton's law."""
    rng = np.random.default_rng(seed)
    t = np.arange(8_000) * 1e-3
    x = 0.02 * np.sin(2.0 * np.pi * 0.31 * t) + 0.008 * np.sin(2.0 * np.pi * 1.13 * t + 1.0)
    v, a = np.gradient(x, 1e-3), np.gradient(np.gradient(x, 1e-3), 1e-3)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + rng.normal(size=len(t)) * 0.3
    force += cogging_n * np.sin(2.0 * np.pi / 5e-3 * x)
    path.parent.mkdir(parents=True, exist_ok=True)
    columns = {"time_s": t, "motor_position_m": np.round(x / 5e-9) * 5e-9, "motor_force_n": force}
    parquet.write_table(pa.table(columns), path)


def done(planned: FleetPlan, out: Path, work: Callable[[Any], Any], limit_s: float = 60.0) -> dict[str, Row]:
    rows = diagnose_fleet(planned, out, Here(), limit_s, work)
    return {f"{row['machine']}/{row['axis']}": row for row in rows}


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    """Write two axes, and a model for one of them."""
    for name in ("machine=m1/axis=x/a.parquet", "machine=m2/axis=x/a.parquet"):
        (tmp_path / "data" / name).parent.mkdir(parents=True)
        (tmp_path / "data" / name).write_bytes(b"recorded")
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "default.toml").write_text(MODEL, encoding="utf-8")
    return tmp_path


def planned(fleet: Path, options: FleetOptions = OPTIONS) -> FleetPlan:
    return plan_fleet(str(fleet / "data"), fleet / "models", fleet / "out", options)


def asked(fleet: Path) -> list[int]:
    return [
        len(file.read_text()) if (file := axis / "calls.txt").exists() else 0
        for axis in sorted((fleet / "data").glob("machine=*/axis=*"))
    ]


def test_completed_axes_are_not_diagnosed_again(fleet: Path) -> None:
    first = planned(fleet)
    rows = diagnose_fleet(first, fleet / "out", Here(), 60.0, fleet_stubs.row)
    next(rows)
    rows.close()  # as by Ctrl-C: one is done, one is not
    assert asked(fleet) == [1, 0]
    done(planned(fleet), fleet / "out", fleet_stubs.row)
    again = planned(fleet)
    assert asked(fleet) == [1, 1]
    assert (again.reused, again.tasks) == (2, [])


@pytest.mark.parametrize("change", ["content", "new file", "model", "mapping", "half written", "reports"])
def test_changed_axes_are_diagnosed_again(fleet: Path, change: str) -> None:
    done(planned(fleet), fleet / "out", fleet_stubs.row)
    place, options = fleet / "data" / "machine=m1" / "axis=x", OPTIONS
    left = 1
    if change == "content":
        os.utime(place / "a.parquet", ns=(1, 1))
    elif change == "new file":
        (place / "b.parquet").write_bytes(b"more")
    elif change == "model":
        (fleet / "models" / "m1.toml").write_text(MODEL.replace("any", "x").replace("50.0", "51.0"))
    elif change == "half written":
        (fleet / "out" / "axes" / "m1" / "x" / "result.json").write_text('{"machine": "m1"')
    elif change == "mapping":
        options, left = OPTIONS._replace(mapping=parse_mapping(["force=f"])), 2
    else:
        options, left = OPTIONS._replace(with_reports=True), 2
    assert len(planned(fleet, options).tasks) == left


def test_an_axis_without_a_model_is_a_row(fleet: Path) -> None:
    (fleet / "models" / "default.toml").rename(fleet / "models" / "m1.toml")
    (fleet / "models" / "m1.toml").write_text(MODEL.replace("any", "x"))
    ready = planned(fleet)
    assert [task.data.name for task in ready.tasks] == ["m1/x"]
    assert ready.rows["m2", "x"]["status"] == "no model"
    assert "looked for m2/x.toml" in ready.rows["m2", "x"]["error"]


def test_a_timeout_is_a_row_and_tried_again_next_time(fleet: Path) -> None:
    row = done(planned(fleet), fleet / "out", fleet_stubs.never_end, 0.05)["m1/x"]
    assert (row["status"], row["error"]) == ("over time", "took longer than 0.05 s")
    assert len(planned(fleet).tasks) == 2


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Row]]:
    """Real diagnoses: an axis with cogging and one bad file, and an axis with bad files only."""
    root = tmp_path_factory.mktemp("fleet")
    record(root / "data" / "machine=m1" / "axis=x" / "good.parquet", 1, 1.5)
    (root / "data" / "machine=m1" / "axis=x" / "bad.parquet").write_bytes(b"rubbish")
    (root / "data" / "machine=m2" / "axis=y").mkdir(parents=True)
    (root / "data" / "machine=m2" / "axis=y" / "bad.parquet").write_bytes(b"rubbish")
    (root / "models").mkdir()
    (root / "models" / "default.toml").write_text(MODEL, encoding="utf-8")
    ready = planned(root)
    rows = done(ready, root / "out", diagnose_axis)
    write_results(ready, root / "out")
    return root, rows


def test_an_invalid_file_is_reported_and_the_others_are_used(diagnosed: tuple[Path, dict[str, Row]]) -> None:
    _, rows = diagnosed
    (bad,) = rows["m1/x"]["bad_files"]
    assert bad["file"] == "bad.parquet"
    assert "not a readable Parquet" in bad["reason"]
    assert (rows["m1/x"]["status"], rows["m1/x"]["recordings"]) == ("diagnosed", 1)
    assert rows["m2/y"]["status"] == "unusable"
    assert "not a readable Parquet" in rows["m2/y"]["error"]


def test_the_verdict_is_that_of_diagnose(diagnosed: tuple[Path, dict[str, Row]], tmp_path: Path) -> None:
    root, rows = diagnosed
    good = root / "data" / "machine=m1" / "axis=x" / "good.parquet"
    alone = diagnose([good], root / "models" / "default.toml", tmp_path, with_report=False)
    kept = json.loads((root / "out" / "axes" / "m1" / "x" / "verdict.json").read_text())
    expected = json.loads(json.dumps(alone.verdict).replace('"any"', '"x"').replace("axis any", "axis x"))
    assert kept == expected
    (effect,) = rows["m1/x"]["effects"]
    (finding,) = alone.verdict["findings"]
    assert effect["effect"] == finding["effect"] == "cogging"
    amplitude = {one["name"]: one for one in effect["parameters"]}["amplitude"]
    assert [amplitude["low"], amplitude["high"]] == finding["parameters"]["amplitude"]["ci95"]
    assert rows["m1/x"]["force_after_n"] == alone.verdict["fit"]["any"]["force"]["after"]["heldout"]


def test_the_updated_model_runs_from_its_directory(diagnosed: tuple[Path, dict[str, Row]]) -> None:
    file = diagnosed[0] / "out" / "axes" / "m1" / "x" / "model.toml"
    assert load_plant(file)
    assert tomllib.loads(file.read_text())["axis"]["x"]["cogging"]


def test_the_table_and_the_page_have_every_axis(diagnosed: tuple[Path, dict[str, Row]]) -> None:
    root, rows = diagnosed
    table = parquet.read_table(root / "out" / "results.parquet").to_pylist()
    assert [(one["machine"], one["axis"]) for one in table] == [("m1", "x"), ("m2", "y")]
    assert table[0] == rows["m1/x"]
    page = (root / "out" / "fleet.html").read_text(encoding="utf-8")
    assert 'href="axes/m1/x/verdict.json"' in page
    assert "1 of 2 machines have physics that their models leave out; most often cogging" in page


def test_a_task_of_another_version_is_refused(fleet: Path) -> None:
    (task, _) = planned(fleet).tasks
    with pytest.raises(ReconcileError, match=r"the fleet was started with 0\.0"):
        diagnose_axis(task._replace(version="0.0"))
