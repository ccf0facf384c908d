"""The next experiment: what is open asks for the motion that closes it, within what the axis has done."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from reconcile_findings import MadeUpExplanation, MadeUpRest
from scipy.ndimage import uniform_filter1d

from hil_sim.config.load import EFFECT_PARAMS
from reconcile.catalogue.kinds import Scene, Sense
from reconcile.catalogue.registry import ENTRIES
from reconcile.findings import Estimate, Finding, Rival
from reconcile.kinematics import kinematics
from reconcile.ledger import Candidate
from reconcile.model_file import NominalAxis
from reconcile.next_experiment import next_experiment
from reconcile.next_experiment_rules import HIDDEN, LIVES_OVER, SHOWN_BY, TOLD_APART
from reconcile.smooth_terms import SMOOTH_TERMS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

T = 1e-3
MASS_KG, VISCOUS_N_S_M, COULOMB_N = 50.0, 100.0, 12.0
LEAD_M = 5e-3
COUNT_M = 5e-9
AXIS = NominalAxis(
    lead_m=LEAD_M,
    force_constant_n_a=500.0,
    mass_kg=MASS_KG,
    motor_mass_kg=0.0,
    viscous_n_s_m=VISCOUS_N_S_M,
    coulomb_n=COULOMB_N,
    encoder_resolution_m=COUNT_M,
    scale_resolution_m=None,
    pole_pairs=None,
    grating_m=None,
    bus=None,
)


def cruise(speed_m_s: float, way_m: float, ramp_s: float) -> Array:
    """Velocities (n,) of a way at constant speed, there and back, with ramps."""
    hold = np.full(max(round(way_m / speed_m_s / T), 1), speed_m_s)
    ramp = np.linspace(0.0, speed_m_s, max(round(ramp_s / T), 2))
    there = np.concatenate((ramp, hold, ramp[::-1]))
    return np.concatenate((there, -there))


def sine(stroke_m: float, hertz: float, cycles: int) -> Array:
    w = 2.0 * np.pi * hertz
    return 0.5 * stroke_m * w * np.cos(w * np.arange(round(cycles / hertz / T)) * T)


def starts(rests_s: Sequence[float]) -> Array:
    """Slow there and back, from a rest each."""
    way = np.full(200, 1e-3)
    parts = [
        np.concatenate((np.zeros(round(rest / T)), sign * way)) for rest in rests_s for sign in (1.0, -1.0)
    ]
    return np.concatenate(parts)


MOTIONS = {
    "constant speeds over the same places": [cruise(v, 0.12, 0.1) for v in (0.04, 0.1, 0.25)],
    "slow constant speeds": [cruise(v, 0.7 * v, 0.02) for v in (2e-3, 8e-3)],
    "small strokes to and fro": [sine(8e-6, 5.0, 8)],
    "slow starts from rest in both directions": [starts([0.2, 0.2, 0.2])],
    "slow starts after rests of several lengths": [starts([0.2, 2.5])],
    "full acceleration up to several speeds": [cruise(0.2, 0.02, 0.02)],
    "decelerations around that of friction alone": [cruise(0.1, 2e-3, 0.4)] * 3,
}
"""By what is recorded with them and not without."""


def scene(velocities: Sequence[Array], *, warmed_k: float | None = 10.0, scale: bool = True) -> Scene:
    rest = np.zeros(100)
    v = uniform_filter1d(np.concatenate([rest, *velocities, rest]), 5)
    motion = kinematics(np.round(np.cumsum(v) * T / COUNT_M) * COUNT_M, T)
    force_n = MASS_KG * motion.acceleration_m_s2 + VISCOUS_N_S_M * v + COULOMB_N * motion.direction
    return Scene(
        period_s=T,
        time_s=np.arange(len(v)) * T,
        motion=motion,
        force_n=force_n,
        model_force_n=force_n,
        lead_m=LEAD_M,
        motor_mass_kg=0.0,
        scale_m=motion.position_m if scale else None,
        temperature_k=None if warmed_k is None else np.linspace(293.0, 293.0 + warmed_k, len(v)),
        others={},
    )


EVERYTHING = scene([part for parts in MOTIONS.values() for part in parts])


def finding(
    effect: str,
    rivals: Sequence[tuple[str, float]] = (),
    equivalent: Sequence[str] = (),
    *,
    confidence: float = 0.99,
    gain: float = 0.5,
    of: str = "",
    **sizes: float,
) -> Finding:
    return Finding(
        effect,
        "force",
        confidence,
        list(equivalent),
        [Rival(name, doubt, 0.9) for name, doubt in rivals],
        [Candidate(of or effect, (), False, (0,))],
        {key: Estimate(value, value, value, "") for key, value in sizes.items()},
        gain,
        gain,
        "",
    )


def asked(of: Scene, findings: Sequence[Finding] = (), minor: Sequence[Finding] = ()) -> dict[str, Any]:
    base = {"mass_kg": MASS_KG, "viscous_n_s_m": VISCOUS_N_S_M, "coulomb_n": COULOMB_N}
    rests = [MadeUpRest("run.csv", of)]
    explanation = MadeUpExplanation(Sense.FORCE, list(findings), base, False, rests, tuple(minor))
    return next_experiment({"x": [explanation]}, {"x": AXIS})


def test_nothing_open_asks_for_nothing() -> None:
    assert asked(EVERYTHING) == {}
    assert asked(EVERYTHING, [finding("cogging", [("torque_ripple", 0.001)])]) == {}


@pytest.mark.parametrize("motion", MOTIONS)
def test_motion_that_was_never_made_is_asked_for(motion: str) -> None:
    without = [part for name, parts in MOTIONS.items() if name != motion for part in parts]
    if motion == "full acceleration up to several speeds":  # high force, but at low speed
        without += [cruise(0.05, 5e-3, 0.008)] * 10
    found = asked(scene(without))
    assert found["motion"] == motion
    assert "lack" in found["why"]


def test_sensors_and_warmth_that_were_missing_are_asked_for() -> None:
    parts = [part for motions in MOTIONS.values() for part in motions]
    assert asked(scene(parts, scale=False))["record_too"] == "the table, by a scale"
    cold = asked(scene(parts, warmed_k=1.0))
    assert cold["motion"] == "the same recordings cold and warm"
    assert "record_too" not in cold
    assert asked(scene(parts, warmed_k=None))["record_too"] == "temperature"


def numbers(of: dict[str, Any], unit: str) -> list[float]:
    values = [value for key, value in of.items() if key.endswith(unit)]
    return [float(one) for value in values for one in (value if isinstance(value, list) else [value])]


@pytest.mark.parametrize("pair", TOLD_APART, ids="-".join)
def test_names_that_cannot_be_told_apart_ask_for_what_the_axis_can_do(pair: tuple[str, str]) -> None:
    found = asked(EVERYTHING, [finding(pair[0], equivalent=[pair[1]])])
    assert found["separates"] == list(pair)
    assert found["axis"] == "x"
    assert found["tells"] == TOLD_APART[pair].tells
    assert json.loads(json.dumps(found)) == found
    assert found == asked(EVERYTHING, [finding(pair[1], equivalent=[pair[0]])]) | {
        key: found[key] for key in ("why", "separates")
    }
    m = EVERYTHING.motion
    speeds = np.abs(m.velocity_m_s) * 1e3
    assert all(3.0 * 0.9e3 * m.creep_m_s <= v <= speeds.max() for v in numbers(found, "_mm_s"))
    assert all(0.0 < a <= np.abs(m.acceleration_m_s2).max() * 1e3 for a in numbers(found, "_mm_s2"))
    assert all(0.0 < s <= np.ptp(m.position_m) * 1e6 for s in numbers(found, "_um"))
    places = numbers(found, "positions_mm") + numbers(found, "from_mm") + numbers(found, "to_mm")
    assert all(m.position_m.min() * 1e3 - 1e-3 <= x <= m.position_m.max() * 1e3 + 1e-3 for x in places)


def test_the_likeliest_rival_is_told_apart_first() -> None:
    rivals = [("torque_ripple", 0.1), ("periodic_disturbance", 0.3)]
    found = asked(EVERYTHING, [finding("cogging", rivals, [name for name, _ in rivals])])
    assert found["separates"] == ["cogging", "periodic_disturbance"]


def test_a_motion_goes_before_a_sensor() -> None:
    screw = finding("lead_error_periodic", equivalent=["encoder_eccentricity"])
    assert asked(EVERYTHING, [screw])["record_too"] == "the table, by an interferometer"
    found = asked(EVERYTHING, [screw, finding("cogging", [("torque_ripple", 0.1)], ["torque_ripple"])])
    assert found["separates"] == ["cogging", "torque_ripple"]


def test_ripple_is_told_by_accelerations_whose_forces_are_those_of_the_axis() -> None:
    found = asked(EVERYTHING, [finding("cogging", equivalent=["torque_ripple"])])
    expected = np.array(found["accelerations_mm_s2"]) * 1e-3 * MASS_KG
    assert found["forces_n"] == pytest.approx(expected, rel=0.1)
    assert max(found["forces_n"]) > 10.0 * min(found["forces_n"]) * 0.8


def test_what_no_entry_explains_is_asked_over_its_coordinate() -> None:
    hidden = finding("unknown", of="unknown:distance_since_reversal")
    found = asked(EVERYTHING, [hidden])
    assert found["motion"] == "small strokes to and fro"
    assert found["separates"] == ["unknown"]
    assert "distance since reversal" in found["why"]


def test_a_name_too_doubtful_to_be_said_is_asked_for_and_one_too_small_is_not() -> None:
    rivals = [("drive_compliance", 0.8)]
    found = asked(EVERYTHING, minor=[finding("backlash", rivals, confidence=0.2)])
    assert found["separates"] == ["backlash", "drive_compliance"]
    assert asked(EVERYTHING, minor=[finding("backlash", rivals, confidence=0.2, gain=0.01)]) == {}


def test_a_name_whose_rival_needed_another_motion_is_doubted_around_its_own_size() -> None:
    fast = scene([part for name, parts in MOTIONS.items() if "slow constant" not in name for part in parts])
    stribeck = finding("stribeck_friction", stribeck_m_s=4e-3)
    found = asked(fast, [stribeck])
    assert found["separates"] == ["stribeck_friction", "presliding_hysteresis"]
    assert found["speeds_mm_s"] == [1.0, 2.0, 4.0, 8.0, 16.0]
    assert asked(EVERYTHING, [stribeck]) == {}


def test_small_strokes_lie_around_the_way_found() -> None:
    presliding = finding("presliding_hysteresis", equivalent=["backlash"], way_m_1=2e-5, way_m_2=1e-6)
    assert asked(EVERYTHING, [presliding])["strokes_um"] == [4.0, 10.0, 20.0, 40.0, 100.0]


def test_coasting_is_where_friction_alone_slows_the_axis_down() -> None:
    zone = finding("amplifier_dead_zone", equivalent=["stribeck_friction"])
    slower = np.array(asked(EVERYTHING, [zone])["decelerations_mm_s2"]) * 1e-3 * MASS_KG
    assert slower.min() < COULOMB_N < slower.max()


def test_every_rule_speaks_of_known_effects_and_every_effect_has_one() -> None:
    spoken = {name for pair in TOLD_APART for name in pair} | set(SHOWN_BY)
    spoken |= {name for pair in HIDDEN.values() for name in pair}
    assert spoken <= set(EFFECT_PARAMS)
    assert set(ENTRIES) <= set(SHOWN_BY)
    assert set(LIVES_OVER) == set(SMOOTH_TERMS)
