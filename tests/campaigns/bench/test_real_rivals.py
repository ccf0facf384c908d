"""The rivals of `make bench-real` against closed forms, and the bars by hand."""

import math
from pathlib import Path

import numpy as np
import pytest

from reconcile.examples.real.judged import error_of, judged
from reconcile.examples.real.machine import Joint, Machine
from tests.campaigns.bench.real_main import lost_to, of_machine, summary
from tests.campaigns.bench.real_rivals import RIVALS

INERTIA_KG_M2, VISCOUS_NM_S, COULOMB_NM, CONSTANT_NM, PERIOD_S = 0.3, 0.8, 1.5, 2.0, 1e-3


def swung(number: int) -> dict[str, np.ndarray]:
    """A joint whose torque is Newton's law written out, with a constant torque that no rigid model has."""
    t = np.arange(8000) * PERIOD_S
    pace = 2.0 * math.pi * (0.7 + 0.1 * number)
    angle, rate, change = np.sin(pace * t), pace * np.cos(pace * t), -(pace**2) * np.sin(pace * t)
    torque = INERTIA_KG_M2 * change + VISCOUS_NM_S * rate + COULOMB_NM * np.sign(rate) + CONSTANT_NM
    return {"time_s": t, "j.motor_position_rad": angle, "j.motor_force_nm": torque}


def machine() -> Machine:
    joint, recordings = Joint(INERTIA_KG_M2), {f"r{number}": swung(number) for number in range(3)}
    return Machine("swing", "a swing", "a constant torque", {"j": joint}, recordings)


def test_rivals_leave_what_they_have_no_term_for(tmp_path: Path) -> None:
    one = machine()
    nominal, paths = one.written(tmp_path)
    files = judged(paths, nominal)["j"]
    train, left_out = [files[0][0], files[2][0]], files[1][0]
    errors = {name: left_out.error(fit(train)(left_out)) for name, fit in RIVALS.items()}
    assert errors["rigid"] == pytest.approx(CONSTANT_NM, rel=0.05)
    assert errors["least_squares"] < 0.05
    # between the paces that it has seen it is no better than a table; in those that it has seen it is
    between, seen = errors["boosting"], train[0].error(RIVALS["boosting"](train)(train[0]))
    assert seen < 0.5 < between < CONSTANT_NM


def test_a_written_model_is_judged_as_it_stands_in_its_file(tmp_path: Path) -> None:
    one = machine()
    nominal, paths = one.written(tmp_path)
    (left_out,) = judged(paths[:1], nominal)["j"][0]
    friction = f"""[axis.j.coulomb_friction]
coulomb_n = {COULOMB_NM}
[axis.j.viscous_friction]
viscous_n_s_m = {VISCOUS_NM_S}
"""
    nominal.write_text(nominal.read_text(encoding="utf-8") + friction, encoding="utf-8")
    assert error_of(nominal, left_out) == pytest.approx(CONSTANT_NM, rel=0.02)


def test_every_recording_of_every_axis_has_a_row(tmp_path: Path) -> None:
    rows = of_machine(machine(), tmp_path, ["r0", "r2"], ["rigid", "least_squares"], lambda _text: None)
    assert [row["left_out"] for row in rows] == ["r0", "r2"]
    (line,) = summary(rows)
    assert line["no_model"] == 2
    assert line["lost_to"] == ["no model"]
    assert line["errors_nm"]["rigid"] == pytest.approx(CONSTANT_NM, rel=0.05)


def test_boosting_has_a_bar_of_its_own() -> None:
    rivals = {"rigid": 2.0, "least_squares": 1.5, "boosting": 1.0, "pysindy": 3.0}
    assert lost_to({"reconcile": 1.1, **rivals}) == []
    assert lost_to({"reconcile": 1.3, **rivals}) == ["boosting"]
    assert lost_to({"reconcile": 1.6, **rivals}) == ["least_squares", "boosting"]
    assert lost_to(rivals) == ["rigid", "least_squares", "boosting", "pysindy"]
