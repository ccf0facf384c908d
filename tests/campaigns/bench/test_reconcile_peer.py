"""The peer of `reconcile` is a fair one: it names what is plain to see, and both are judged by one rule."""

import math
from pathlib import Path

import numpy as np
import pytest

from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording
from tests.campaigns.bench.reconcile_score import ToolAnswer, finding, judge, summary

T, N = 2e-3, 5_000
LEAD_M = 5e-3
MODEL = """
[axis.x.transmission]
lead_mm = 5.0
[axis.x.motor]
torque_constant_nm_a = 0.4
[axis.x.table]
mass_kg = 50.0
"""


@pytest.fixture
def recording() -> AxisRecording:
    """An axis that sweeps, with 3 N of cogging twice a turn and 2 um of lead error once a turn."""
    rng = np.random.default_rng(1)
    t = np.arange(N) * T
    x = 0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(2.0 * math.pi * 0.83 * t + 1.0)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + 0.3 * rng.normal(size=N)
    force += 3.0 * np.sin(2.0 * 2.0 * math.pi / LEAD_M * x + 0.4)
    scale = x + 2e-6 * np.sin(2.0 * math.pi / LEAD_M * x + 0.7) + 2e-8 * rng.normal(size=N)
    return AxisRecording("made", "x", T, t, x, force, scale, None, None, {})


def test_pysindy_names_a_simple_term_and_predicts_it(recording: AxisRecording, tmp_path: Path) -> None:
    pytest.importorskip("pysindy")
    from tests.campaigns.bench import sindy_peer  # noqa: PLC0415  # only where pysindy is

    model = tmp_path / "nominal.toml"
    model.write_text(MODEL, encoding="utf-8")
    few = sindy_peer.Rules(ridges=(1e-2,), thresholds=(0.1, 0.2), ensemble=0)
    peer = sindy_peer.diagnose([recording], load_model(model).axes["x"], few)
    assert {"cogging", "lead_error_periodic"} <= {effect for effect, _ in peer.named[:3]}
    for held in peer.held_out.values():
        assert held.after < 0.5 * held.refitted


def test_the_peers_names_are_counted_by_the_rule_of_the_blind_trials() -> None:
    planted = {
        "name": "stribeck_friction",
        "catalogue": True,
        "observable": True,
        "why_not": "",
        "share": 0.4,
        "rms": 2.0,
        "deviation": False,
        "also": [],
        "alike": [],
        "parameters": {"stribeck_n": 3.0},
    }
    truth = {
        "kind": "single",
        "effects": [planted],
        "clutter": {"cogging": 0.1},
        "production": False,
        "nominal": "fitted",
        "sensing": {"has_scale": False, "has_temperature": False, "is_command": False},
        "runs": [],
    }
    answers = [
        _answer_with("stribeck_friction"),
        _answer_with("backlash", "stribeck_friction"),
        _answer_with(("quadratic_viscous_friction", "stribeck_friction")),
        ToolAnswer("failed", [], {}, {}, 0.0, "it fell over"),
    ]
    lines = summary([(judge(truth, answer), answer) for answer in answers])
    assert lines["first name right, one effect"]["count"] == 1
    assert lines["first name right or of its class"]["count"] == 2
    assert lines["found at all, one effect"]["count"] == 3
    assert lines["a false name, any case"]["count"] == 1
    assert lines["failures"]["value"] == 1
    assert lines["first name right, one effect"]["of"] == 4


def _answer_with(*names: str | tuple[str, str]) -> ToolAnswer:
    """Effects, some with an equivalent."""
    pairs = [(name, ()) if isinstance(name, str) else (name[0], name[1:]) for name in names]
    return ToolAnswer("effects", [finding("x", name, alike, 0.5) for name, alike in pairs], {}, {}, 1.0)
