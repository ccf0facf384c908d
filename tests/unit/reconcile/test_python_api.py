"""`reconcile.diagnose` accepts tables of several libraries and returns one typed result."""

import math
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

import reconcile
from reconcile.api.diagnose import files_of
from reconcile.formats.arrow_files import read_parquet

MODEL = {
    "axis": {
        "x": {
            "transmission": {"lead_mm": 5.0},
            "motor": {"torque_constant_nm_a": 0.4},
            "table": {"mass_kg": 50.0},
            "viscous_friction": {"viscous_n_s_m": 100.0},
            "coulomb_friction": {"coulomb_n": 12.0},
        }
    }
}
AMPLITUDE_N = 3.0


def frame() -> dict[str, Any]:
    """20 s of an axis with cogging of the screw's period, by Newton's law."""
    rng = np.random.default_rng(3)
    t = np.arange(20_000) * 1e-3
    x = 0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(2.0 * math.pi * 1.13 * t + 1.0)
    v, a = np.gradient(x, 1e-3), np.gradient(np.gradient(x, 1e-3), 1e-3)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + AMPLITUDE_N * np.sin(2.0 * math.pi / 5e-3 * x)
    return {"time_s": t, "motor_position_m": x, "motor_force_n": force + rng.normal(size=t.size) * 0.3}


@pytest.fixture(scope="module")
def found() -> reconcile.Diagnosis:
    return reconcile.diagnose(pd.DataFrame(frame()), MODEL, proof=False)


def test_cogging_is_a_typed_finding_with_its_interval(found: reconcile.Diagnosis) -> None:
    cogging = next(one for one in found.findings if one.effect == "cogging")
    amplitude = cogging.parameters["amplitude"]
    assert cogging.axis == "x"
    assert amplitude.unit == "N"
    assert amplitude.value == pytest.approx(AMPLITUDE_N, rel=0.05)
    assert amplitude.low < amplitude.value < amplitude.high


def test_the_model_is_toml_that_holds_the_effect_and_finds_its_eds_file(found: reconcile.Diagnosis) -> None:
    document = tomllib.loads(found.model.to_toml())
    assert "cogging" in document["axis"]["x"]
    assert Path(document["axis"]["x"]["drive"]["eds"]).is_file()


def test_the_residual_is_drawn_and_a_notebook_shows_a_table(found: reconcile.Diagnosis) -> None:
    (axes,) = found.plot.residual().axes
    before, _, after = (np.asarray(line.get_ydata()) for line in axes.get_lines())
    assert np.nanstd(after) < 0.5 * np.nanstd(before)
    assert "<td>cogging</td>" in found._repr_html_()


def test_tables_of_all_libraries_are_the_same_recording(tmp_path: Path) -> None:
    columns = frame()
    kinds = [(name, "f8") for name in columns]
    rows = np.array(list(zip(*columns.values(), strict=True)), dtype=kinds)
    files = files_of([columns, pd.DataFrame(columns), pa.table(columns), rows], tmp_path)
    tables = [read_parquet(file) for file in files]
    for name, values in columns.items():
        assert all(np.array_equal(table.columns[name].values, values) for table in tables)


@pytest.mark.parametrize("wrong", [42, {"time_s": [0.0, 1.0], "motor_force_n": [0.0]}])
def test_what_is_no_table_is_refused_with_a_reason(wrong: Any) -> None:
    with pytest.raises(reconcile.ReconcileError, match="is not a table"):
        reconcile.diagnose(wrong, MODEL)


def test_no_recording_at_all_is_refused() -> None:
    with pytest.raises(reconcile.ReconcileError, match="there is no recording"):
        reconcile.diagnose([], MODEL)


@pytest.mark.parametrize("package", ["reconcile", "servo_ctrl", "hil_sim"])
def test_importing_a_package_loads_next_to_nothing(package: str) -> None:
    code = f"import sys; before = set(sys.modules); import {package}; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert package in loaded
    assert not {name.partition(".")[0] for name in loaded} & {"numpy", "numba", "pyarrow", "asyncio", "can"}
    assert len(loaded) < 60


@pytest.mark.parametrize("package", ["reconcile", "servo_ctrl", "hil_sim"])
def test_every_public_name_is_there(package: str) -> None:
    module = __import__(package)
    assert all(getattr(module, name) is not None for name in module.__all__)
    with pytest.raises(AttributeError, match="nonsense"):
        module.nonsense  # noqa: B018
