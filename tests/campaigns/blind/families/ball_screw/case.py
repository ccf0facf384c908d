"""Draw a ball-screw table, what it conceals, and its recordings."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.signal import lfilter

from tests.campaigns.blind.families.ball_screw import motions
from tests.campaigns.blind.families.ball_screw.axis import Gains, Screw, run
from tests.campaigns.blind.families.interface import Array, Case, Channels, Effect, Nominal, plan, sheet

PERIOD_S = 1e-3
MOTIONS = {"jogs": motions.jogs, "circles": motions.circles, "contour": motions.contour}
Random = np.random.Generator
Hidden = tuple[dict[str, float], Effect]


def _either(rng: Random) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _stribeck(p: Screw, rng: Random) -> Hidden:
    values = {"rise_n": rng.uniform(0.3, 0.9) * p.coulomb_n, "rise_m_s": rng.uniform(0.002, 0.012)}
    return values, Effect("stribeck_friction", {})


def _preslide(_p: Screw, rng: Random) -> Hidden:
    return {"preslide_m": 10.0 ** rng.uniform(-4.8, -4.1)}, Effect("presliding_hysteresis", {})


def _uneven(p: Screw, rng: Random) -> Hidden:
    half = _either(rng) * rng.uniform(0.12, 0.4) * p.coulomb_n
    effect = Effect("asymmetric_coulomb_friction", {"force_n": -half}, alike=("constant_force",))
    return {"bias_n": half}, effect


def _uneven_viscous(p: Screw, rng: Random) -> Hidden:
    half = _either(rng) * rng.uniform(0.2, 0.5) * p.viscous
    return {"viscous_bias": half}, Effect("asymmetric_viscous_friction", {"half_difference_n_s_m": half})


def _tilted(_p: Screw, rng: Random) -> Hidden:
    values = {"tilt": _either(rng) * rng.uniform(0.15, 0.5), "tilt_m": rng.uniform(0.05, 0.2)}
    return values, Effect("position_dependent_friction", {})


def _thin(_p: Screw, rng: Random) -> Hidden:
    return {"thinning": rng.uniform(0.15, 0.4)}, Effect("temperature_dependent_friction", {})


def _push(p: Screw, rng: Random) -> Hidden:
    force_n = _either(rng) * rng.uniform(0.3, 1.2) * p.coulomb_n
    return {"push_n": force_n}, Effect(
        "constant_force", {"force_n": force_n}, alike=("asymmetric_coulomb_friction",)
    )


def _play(_p: Screw, rng: Random) -> Hidden:
    gap = 10.0 ** rng.uniform(-5.7, -4.4)
    effect = Effect("backlash", {"play_m": 0.5 * gap}, "deviation", also=("drive_compliance",))
    return {"gap_m": gap}, effect


def _soft(p: Screw, rng: Random) -> Hidden:
    stiffness = 10.0 ** rng.uniform(7.1, 8.0)
    reduced = p.rotor_kg * p.table_kg / (p.rotor_kg + p.table_kg)
    values = {"stiffness": stiffness, "damping": 0.12 * math.sqrt(stiffness * reduced)}
    return values, Effect("drive_compliance", {"stiffness_n_m": stiffness}, "deviation")


def _stretch(_p: Screw, rng: Random) -> Hidden:
    share = _either(rng) * rng.uniform(1e-5, 9e-5)
    return {"stretch": share}, Effect("lead_error_cumulative", {"relative_error": share}, "deviation")


def _wobble(_p: Screw, rng: Random) -> Hidden:
    size = rng.uniform(0.8e-6, 5e-6)
    known = {"harmonic": 1.0, "amplitude": size}
    effect = Effect("lead_error_periodic", known, "deviation", alike=("encoder_eccentricity",))
    return {"wobble_m": size}, effect


def _off_centre(_p: Screw, rng: Random) -> Hidden:
    size = rng.uniform(0.8e-6, 5e-6)
    known = {"harmonic": 1.0, "amplitude": size}
    effect = Effect("encoder_eccentricity", known, "deviation", alike=("lead_error_periodic",))
    return {"off_centre_m": size}, effect


def _growth(_p: Screw, rng: Random) -> Hidden:
    return {"growth_1_k": rng.uniform(0.5e-5, 1.3e-5)}, Effect("thermal_expansion", {}, "deviation")


def _grating(_p: Screw, rng: Random) -> Hidden:
    size, pitch = rng.uniform(0.2e-6, 1.2e-6), float(rng.choice([2e-5, 4e-5, 1e-4, 2e-4]))
    effect = Effect("scale_cyclic_error", {"period_m": pitch, "amplitude": size}, "deviation")
    return {"grating_m": size, "grating_pitch_m": pitch}, effect


EFFECTS: dict[str, Callable[[Screw, Random], Hidden]] = {
    "stribeck_friction": _stribeck,
    "presliding_hysteresis": _preslide,
    "asymmetric_coulomb_friction": _uneven,
    "asymmetric_viscous_friction": _uneven_viscous,
    "position_dependent_friction": _tilted,
    "temperature_dependent_friction": _thin,
    "constant_force": _push,
    "backlash": _play,
    "drive_compliance": _soft,
    "lead_error_cumulative": _stretch,
    "lead_error_periodic": _wobble,
    "encoder_eccentricity": _off_centre,
    "thermal_expansion": _growth,
    "scale_cyclic_error": _grating,
}
WARM = {"temperature_dependent_friction", "thermal_expansion"}
CONFLICTS = [
    frozenset({"asymmetric_coulomb_friction", "constant_force"}),
    frozenset({"lead_error_periodic", "encoder_eccentricity"}),
    frozenset({"backlash", "drive_compliance"}),
    frozenset({"backlash", "presliding_hysteresis"}),
]


def draw(seed: int, kind: str | None = None, names: Sequence[str] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` in place of what the seed would conceal."""
    rng = np.random.default_rng([1701, seed])
    drawn_kind, drawn_names = plan(rng, list(EFFECTS), CONFLICTS, kind)
    lead = float(rng.choice([0.005, 0.01, 0.016, 0.02]))
    p = Screw(
        rotor_kg=rng.uniform(5.0, 40.0), table_kg=rng.uniform(10.0, 80.0), viscous=rng.uniform(20.0, 160.0),
        coulomb_n=rng.uniform(5.0, 35.0), preslide_m=rng.uniform(0.6e-6, 2e-6), lead_m=lead,
        phase=rng.uniform(0.0, 2.0 * math.pi), encoder_m=lead / 2 ** int(rng.integers(18, 21)),
        scale_m=float(rng.choice([1e-8, 5e-8, 1e-7])),
    )  # fmt: skip
    hidden = [EFFECTS[name](p, rng) for name in (drawn_names if names is None else names)]
    mass = p.rotor_kg + p.table_kg
    gains = Gains(
        rng.uniform(25.0, 60.0), mass * rng.uniform(120.0, 250.0), rng.uniform(8.0, 25.0), mass, 60.0
    )
    travel, fastest = rng.uniform(0.15, 0.4), rng.uniform(0.1, 0.35)
    has_scale = rng.random() < 0.8 or any(effect.side == "deviation" for _, effect in hidden)
    is_warm = rng.random() < 0.5 or any(effect.name in WARM for _, effect in hidden)
    runs = [str(name) for name in rng.permutation(list(MOTIONS))][: int(rng.integers(2, 4))]
    if "jogs" not in runs:
        runs[0] = "jogs"
    lengths = [round(rng.uniform(10.0, 16.0) / PERIOD_S) for _ in runs]

    def simulate(acting: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        q = p
        for fields, effect in hidden:
            if effect.name in acting:
                q = q._replace(**fields)
        out = []
        for number, (name, n) in enumerate(zip(runs, lengths, strict=True)):
            own = np.random.default_rng([1702, seed, number])
            wanted = MOTIONS[name](own, travel, fastest, n, PERIOD_S)
            share = np.linspace(number, number + 1.0, n) / len(runs) if is_warm else np.zeros(n)
            outer = np.zeros(n) if foreign is None else foreign[number]
            noise = _noise(own, n, p)
            rows = run(q, gains, wanted, PERIOD_S, noise, share, outer, noisy)
            channels = {"time": np.arange(n) * PERIOD_S, "motor": rows[:, 0], "force": rows[:, 1]}
            if has_scale:
                channels["scale"] = rows[:, 2]
            channels["command"] = wanted[:, 0]
            if is_warm:
                kelvin = 293.15 + 12.0 * share + noisy * own.normal(size=n) * 0.02
                channels["temperature"] = np.round(kelvin, 2) if noisy else kelvin
            out.append(channels)
        return out

    sound = Nominal(mass, p.viscous, p.coulomb_n, p.encoder_m, p.scale_m if has_scale else 0.0, lead)
    return Case(
        "ball_screw", seed, drawn_kind, sheet(rng, sound), sound, tuple(effect for _, effect in hidden),
        simulate, clutter=("presliding_hysteresis", "drive_compliance"), as_csv=bool(rng.random() < 0.3),
    )  # fmt: skip


def _noise(rng: Random, n: int, p: Screw) -> Array:
    """Return noise (n, 3) of encoder, scale and force: resonant, wandering, and of second order."""
    white = rng.normal(size=(n, 3))
    encoder = lfilter([1.0], [1.0, -0.6], white[:, 0]) * 0.8 * p.encoder_m
    wander = lfilter([0.02], [1.0, -0.998], white[:, 1]) * 4e-8
    r, angle = 0.93, 2.0 * math.pi * 135.0 * PERIOD_S
    force = lfilter([0.07], [1.0, -2.0 * r * math.cos(angle), r * r], white[:, 2])
    force = force * 0.03 * p.coulomb_n + lfilter([0.1], [1.0, -0.9], rng.normal(size=n)) * 0.03 * p.coulomb_n
    return np.stack((encoder, wander, force), axis=1)
