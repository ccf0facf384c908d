"""A rotary axis: model file, columns, units; the written file is a plant and can be read again."""

import math
import re
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from hil_sim.config import load_plant
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import load_model
from reconcile.report.console import show

T, N = 2e-3, 8_000
GEAR, INERTIA_KG_M2, GRAVITY_NM = 10.0, 0.05, 1.2
MODEL = f"""
[axis.j]
motion = "rotary"
transmission.gear_ratio = {GEAR}
table.inertia_kg_m2 = 0.06
viscous_friction.viscous_nm_s_rad = 0.02
coulomb_friction.coulomb_nm = 0.1
"""


def recorded(path: Path, number: int = 0, position: str = "joint_position_deg") -> Path:
    """Write the recording of a pendulum: gravity is proportional to the sine of its angle."""
    rng, t = np.random.default_rng(number), np.arange(N) * T
    q = 1.2 * np.sin((1.7 + 0.3 * number) * t) + 0.5 * np.sin(5.3 * t + number)
    w, a = np.gradient(q, T), np.gradient(np.gradient(q, T), T)
    torque = INERTIA_KG_M2 * a + 0.03 * w + 0.1 * np.sign(w) + GRAVITY_NM * np.sin(q)
    torque += rng.normal(size=N) * 0.005
    counted = np.round(q / 1e-5) * 1e-5
    columns = np.stack((t, np.degrees(counted), torque), axis=1)
    np.savetxt(path, columns, delimiter=",", comments="", header=f"time_s,{position},joint_torque_nm")
    return path


def model(folder: Path, text: str = MODEL) -> Path:
    (folder / "model.toml").write_text(text, encoding="utf-8")
    return folder / "model.toml"


def test_gravity_is_named_in_newton_metres_and_the_written_plant_is_consistent(tmp_path: Path) -> None:
    files = [recorded(tmp_path / f"r{number}.csv", number) for number in range(3)]
    options: dict[str, Any] = {"with_report": False, "with_next": False}
    found = diagnose(files, model(tmp_path), tmp_path / "out", **options)
    by_name = {f["effect"]: f for f in found.verdict["findings"]}
    assert "gravity" in by_name
    amplitude = next(p for p in by_name["gravity"]["parameters"].values() if p["unit"] == "N m")
    assert abs(amplitude["value"]) == pytest.approx(GRAVITY_NM, rel=0.03)
    [proof] = found.verdict["proof"]["j"]
    assert proof["written"] < 0.1 * proof["rigid"]
    assert load_plant(found.model_file).axes["j"].effects["gravity"]
    again = load_model(found.model_file).axes["j"]
    assert again.rotary
    assert again.lead_m == pytest.approx(2.0 * math.pi / GEAR)
    assert again.mass_kg == pytest.approx(INERTIA_KG_M2, rel=0.05)
    second = diagnose(files, found.model_file, tmp_path / "second", **options)
    assert second.verdict["verdict"] == "consistent"


def test_no_text_has_newtons_or_metres(tmp_path: Path) -> None:
    files = [recorded(tmp_path / f"r{number}.csv", number) for number in range(2)]
    wrong = MODEL.replace("0.06", "0.9") + "encoder.counts_per_rev = 1000\n"
    found = diagnose(files, model(tmp_path, wrong), tmp_path / "out", with_next=False)
    console = Console(record=True, width=200, file=StringIO())
    show(found.verdict, console)
    assert found.report_file is not None
    page = found.report_file.read_text(encoding="utf-8")
    page = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    said = {
        "verdict": found.verdict_file.read_text(encoding="utf-8"),
        "terminal": console.export_text(),
        "report": re.sub(r"<[^>]*>", " ", page),
    }
    for where, text in said.items():
        assert "N m" in text, where
        linear = re.findall(r'.{30}[\d("] ?(?:N(?! m)|kg(?! m\^?[2²])|[umµn]?m(?:/s)?)\b.{9}', text)
        assert not linear, where
        assert not re.search(r"newtons?\b(?! metre)|(?<!newton )metres?\b", text), where


def test_an_angle_of_a_linear_axis_is_refused(tmp_path: Path) -> None:
    linear = MODEL.replace('motion = "rotary"', "").replace("gear_ratio = 10.0", "lead_mm = 5.0")
    linear = linear.replace("inertia_kg_m2", "mass_kg") + "motor.torque_constant_nm_a = 0.4\n"
    with pytest.raises(ReconcileError, match="rotary axis"):
        diagnose([recorded(tmp_path / "r.csv")], model(tmp_path, linear), tmp_path / "out")


def test_another_motion_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ReconcileError, match="neither of linear, rotary"):
        load_model(model(tmp_path, MODEL.replace('"rotary"', '"helical"')))
