"""A load on a spring that ordinary moves excite only where their acceleration jumps."""

import math
from pathlib import Path

import numpy as np
import pytest
from nominal_model_text import WITHOUT_SCALE
from scipy.signal import lsim

from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.identification.explain import Explanation, explain, without
from reconcile.identification.parameter_estimates import Estimate
from reconcile.identification.term_search import TermSearch
from reconcile.nominal_model.model_file import load_model
from reconcile.recording.recording import AxisRecording
from reconcile.selection.selection_rules import SelectionRules

PERIOD_S, COUNT_M = 1e-3, 2e-8
MOTOR_KG, LOAD_KG, VISCOUS_N_S_M, NOISE_N = 20.0, 30.0, 100.0, 0.3
ANTIRESONANCE_HZ, DAMPING_RATIO = 20.0, 0.03
HUM_N, HUM_HZ = 4.0, 12.3


def moves(rng: np.random.Generator, seconds: float) -> Array:
    """Position, velocity, acceleration (n, 3): half cosines of speed between random places, with pauses."""
    rows, now = [np.zeros((300, 3))], 0.0
    while sum(map(len, rows)) < seconds / PERIOD_S:
        way, lasts_s = float(rng.uniform(-0.05, 0.05)) - now, float(rng.uniform(0.3, 0.9))
        s, rate = np.arange(1, round(lasts_s / PERIOD_S) + 1) * PERIOD_S / lasts_s, math.pi / lasts_s
        speed, turn = 0.5 * way * rate * np.sin(math.pi * s), 0.5 * way * rate**2 * np.cos(math.pi * s)
        rows.append(np.stack((now + 0.5 * way * (1.0 - np.cos(math.pi * s)), speed, turn), axis=1))
        now += way
        rows.append(np.tile((now, 0.0, 0.0), (round(float(rng.uniform(0.05, 0.2)) / PERIOD_S), 1)))
    return np.concatenate(rows)[: round(seconds / PERIOD_S)]


def recorded(seed: int, load_kg: float = LOAD_KG, hum_n: float = 0.0) -> AxisRecording:
    """Motor and load on a spring (rigid if `load_kg` is 0) under PD with feedforward; a hum on the load."""
    rng = np.random.default_rng(seed)
    wanted = moves(rng, 8.0)
    whole_kg, motor_kg = MOTOR_KG + LOAD_KG, MOTOR_KG + LOAD_KG - load_kg
    w = 2.0 * math.pi * ANTIRESONANCE_HZ
    k, c = load_kg * w**2, 2.0 * DAMPING_RATIO * load_kg * w
    p, d = whole_kg * 25.0**2, 1.4 * whole_kg * 25.0
    per_load = 1.0 / load_kg if load_kg else 0.0
    a = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-(k + p) / motor_kg, -(c + d + VISCOUS_N_S_M) / motor_kg, k / motor_kg, c / motor_kg],
            [0.0, 0.0, 0.0, 1.0],
            [k * per_load, c * per_load, -k * per_load, -c * per_load],
        ]
    )
    gains = np.array([p, d + VISCOUS_N_S_M, whole_kg])
    b = np.zeros((4, 2))
    b[1, 0] = 1.0 / motor_kg
    b[3 if load_kg else 1, 1] = per_load or 1.0 / motor_kg
    time_s = np.arange(len(wanted), dtype=np.float64) * PERIOD_S
    asked_n, hum = wanted @ gains, hum_n * np.sin(2.0 * math.pi * HUM_HZ * time_s + seed)
    _, states, _ = lsim((a, b, np.eye(4), np.zeros((4, 2))), np.stack((asked_n, hum), axis=1), time_s)
    force_n = asked_n - p * states[:, 0] - d * states[:, 1] + rng.normal(scale=NOISE_N, size=len(time_s))
    motor_m = np.round(states[:, 0] / COUNT_M) * COUNT_M
    return AxisRecording(
        f"{seed}", "x", PERIOD_S, time_s, np.asarray(motor_m), np.asarray(force_n), None, None, None, {}
    )


def explained(recordings: list[AxisRecording], directory: Path) -> Explanation:
    file = directory / "nominal.toml"
    file.write_text(WITHOUT_SCALE, encoding="utf-8")
    axis = load_model(file).axes["x"]
    return explain(TermSearch(recordings, axis, ResidualChannel.FORCE, SelectionRules()))


def effects(found: Explanation) -> set[str]:
    assert found.selected is not None
    return {c.effect for c in found.selected.terms}


def parameters(found: Explanation, effect: str) -> dict[str, Estimate]:
    [one] = [f for f in (*found.findings, *found.minor) if f.effect == effect]
    return one.parameters


def test_moves_with_jumps_of_acceleration_tell_the_spring_and_what_acts_behind_it(tmp_path: Path) -> None:
    found = explained([recorded(seed, hum_n=HUM_N) for seed in (1, 2, 3)], tmp_path)
    spring = parameters(found, "drive_compliance")
    assert spring["antiresonance_hz"].value == pytest.approx(ANTIRESONANCE_HZ, rel=0.02)
    assert spring["load_mass_kg"].value == pytest.approx(LOAD_KG, rel=0.1)
    hum = parameters(found, "periodic_disturbance")["amplitude"]
    passed_on = 1.0 - (HUM_HZ / ANTIRESONANCE_HZ) ** 2
    assert hum.value == pytest.approx(HUM_N, rel=0.05)
    # it may act on the motor as well, which then takes all that the spring makes of it
    assert hum.low < HUM_N < HUM_N / passed_on < hum.high


def test_a_rigid_axis_has_no_spring_and_the_disturbance_keeps_its_interval(tmp_path: Path) -> None:
    found = explained([recorded(seed, 0.0, HUM_N) for seed in (1, 2, 3)], tmp_path)
    assert "drive_compliance" not in effects(found)
    hum = parameters(found, "periodic_disturbance")["amplitude"]
    assert hum.low < HUM_N < hum.high < 1.2 * HUM_N


def test_what_rings_in_one_recording_only_is_no_spring(tmp_path: Path) -> None:
    found = explained([recorded(1, 0.0), recorded(2), recorded(3, 0.0)], tmp_path)
    assert "drive_compliance" not in effects(found)


def test_without_the_spring_the_disturbance_is_that_on_the_motor(tmp_path: Path) -> None:
    found = explained([recorded(seed, hum_n=HUM_N) for seed in (1, 2)], tmp_path)
    rigid = without(found, {"drive_compliance"}, parameters_only=True)
    on_load, on_motor = (parameters(one, "periodic_disturbance")["amplitude"] for one in (found, rigid))
    assert on_motor.value > 1.05 * on_load.value
