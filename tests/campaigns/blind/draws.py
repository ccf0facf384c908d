"""Draw a case from a seed: a typical axis, a controller, sensors, motions, and concealed effects."""

import math

import numpy as np

from tests.campaigns.blind.case import Case, Planted, Run, Sensing
from tests.campaigns.blind.effects import CATALOGUE, COMMAND_ONLY, CONFLICTS
from tests.campaigns.blind.foreign import FOREIGN
from tests.campaigns.blind.motions import PRODUCTION, TEST, Reach
from tests.campaigns.blind.plant import Loop, Plant
from tests.campaigns.blind.setting import Setting

Random = np.random.Generator

SCALE_WANDER = "wander_of_the_scale"
SHARES = {"none": 0.14, "parameters": 0.08, "single": 0.46, "several": 0.2, "foreign": 0.12}
"""Probability of each kind of a case; chosen."""
SCALE_ONLY = frozenset(
    {
        "backlash",
        "drive_compliance",
        "lead_error_cumulative",
        "lead_error_periodic",
        "encoder_eccentricity",
        "thermal_expansion",
        "scale_cyclic_error",
    }
)
"""Effects that only a scale shows."""
WARMED = frozenset({"thermal_expansion", "temperature_dependent_friction"})
"""Effects that need a temperature rise."""


def draw(seed: int, kind: str | None = None, names: tuple[str, ...] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` of the concealed effects replace those of the draw."""
    rng = np.random.default_rng([20260, seed])
    if kind is None:
        kind = "single" if names else str(rng.choice(list(SHARES), p=list(SHARES.values())))
    names = _names(kind, rng) if names is None else names
    linear = rng.random() < 0.2 and not {"backlash", "drive_compliance", "lead_error_periodic"} & set(names)
    lead_m = float(
        rng.choice([0.02, 0.024, 0.03, 0.032] if linear else [0.002, 0.004, 0.005, 0.01, 0.016, 0.02])
    )
    reach = Reach(
        _spread(rng, 0.08, 0.5), min(_spread(rng, 0.05, 0.5), lead_m * 40.0), _spread(rng, 1.0, 6.0)
    )
    sound = _sound(rng, reach, linear=linear, lead_m=lead_m)
    peak_n = (
        (sound.motor_kg + sound.table_kg) * reach.acceleration_m_s2
        + sound.coulomb_n
        + sound.viscous_n_s_m * reach.velocity_m_s
    )
    plant, planted = sound, []
    for name in sorted(
        names, key=lambda n: n == "backlash"
    ):  # the stiffness must be known before the backlash
        if name == SCALE_WANDER:
            planted.append(Planted(name, {}, (), deviation=True, catalogue=False))
            continue
        source = CATALOGUE if name in CATALOGUE else FOREIGN
        plant, truth = source[name](plant, Setting(lead_m, reach, peak_n, rng))
        planted.append(truth)
    sensing = _sensing(rng, sound, names, lead_m)
    production = bool(rng.random() < 0.2)
    warm = bool(WARMED & set(names))
    factors = np.ones(3)
    nominal = str(rng.choice(["fitted", "sheet", "wrong"], p=[0.6, 0.2, 0.2]))
    if kind in {"none", "parameters"}:
        nominal = "fitted" if kind == "none" else "wrong"
    if nominal == "sheet":
        factors = 1.0 + rng.normal(size=3) * 0.03
    if nominal == "wrong":
        factors = np.exp(rng.uniform(0.15, 0.45, 3) * rng.choice([-1.0, 1.0], 3))
    grown = rng.uniform(8e-6, 24e-6) if "thermal_expansion" in names else 0.0
    return Case(
        seed,
        kind,
        plant._replace(motor_count_m=_motor_count(rng, lead_m), scale_count_m=_scale_count(rng)),
        sound,
        _loop(rng, plant, peak_n, has_scale=sensing.has_scale),
        sensing,
        reach,
        lead_m,
        sensing.period_s / max(round(sensing.period_s / 5e-4), 1),
        _runs(rng, lead_m, names, production=production, warm=warm),
        tuple(planted),
        nominal,
        (float(factors[0]), float(factors[1]), float(factors[2])),
        production,
        rng.uniform(4.0, 12.0) if warm else rng.uniform(0.0, 0.3),
        grown,
        rng.choice([-0.5, 0.5]) * reach.travel_m * rng.uniform(1.0, 1.5),
        towing="cross_axis_coupling" in names,
    )


def _spread(rng: Random, low: float, high: float) -> float:
    """Draw from the log-uniform distribution between both."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _names(kind: str, rng: Random) -> tuple[str, ...]:
    if kind == "foreign":
        return (str(rng.choice([*FOREIGN, SCALE_WANDER])),)
    count = {"none": 0, "parameters": 0, "single": 1, "several": int(rng.integers(2, 4))}[kind]
    while True:
        names = tuple(str(name) for name in rng.choice(list(CATALOGUE), count, replace=False))
        if not any(len(pair & set(names)) > 1 for pair in CONFLICTS):
            return names


def _sound(rng: Random, reach: Reach, *, linear: bool, lead_m: float) -> Plant:
    """Draw the axis without concealed effects; it always has a little presliding and a small ripple."""
    mass_kg = _spread(rng, 10.0, 150.0)
    coulomb_n = _spread(rng, 3.0, 40.0)
    rotor = 0.05 if linear else rng.uniform(0.15, 0.4)
    return Plant(
        motor_kg=mass_kg * rotor,
        table_kg=mass_kg * (1.0 - rotor),
        coulomb_n=coulomb_n,
        viscous_n_s_m=rng.uniform(0.3, 1.5) * coulomb_n / reach.velocity_m_s,
        presliding_m=_spread(rng, 0.5e-6, 4e-6),
        sharpness=rng.uniform(1.3, 3.0),
        unloading=rng.uniform(0.35, 0.6),
        nut_share=0.0 if linear else rng.uniform(0.2, 0.6),
        clutter_n=rng.uniform(0.01, 0.05) * coulomb_n,
        clutter_1_m=2.0 * math.pi / lead_m * float(rng.choice([1, 2, 5, 6, 10, 12])),
        clutter_phase_rad=rng.uniform(0.0, 2.0 * math.pi),
    )


def _sensing(rng: Random, sound: Plant, names: tuple[str, ...], lead_m: float) -> Sensing:
    seldom = rng.random() < 0.08
    by_scale = bool((SCALE_ONLY | {SCALE_WANDER}) & set(names))
    by_command = bool((COMMAND_ONLY | {"dead_time_that_jumps"}) & set(names))
    return Sensing(
        has_scale=(rng.random() < 0.6 or by_scale) and not seldom,
        has_temperature=bool(rng.random() < 0.5),
        is_command=by_command and not seldom if by_command else bool(rng.random() < 0.35),
        period_s=float(rng.choice([5e-4, 1e-3, 1e-3, 1e-3, 2e-3])),
        force_noise_n=_spread(rng, 0.02, 0.1) * sound.coulomb_n,
        force_drift_n=_spread(rng, 0.008, 0.03) * sound.coulomb_n,
        force_count_n=_spread(rng, 0.002, 0.02) * sound.coulomb_n,
        motor_noise_m=lead_m * _spread(rng, 1e-7, 2e-6),
        scale_noise_m=_spread(rng, 5e-9, 4e-8),
        scale_wander_m=rng.uniform(3e-6, 8e-6) if SCALE_WANDER in names else _spread(rng, 5e-9, 5e-8),
        as_csv=bool(rng.random() < 0.2),
    )


def _motor_count(rng: Random, lead_m: float) -> float:
    return lead_m / float(rng.choice([10_000, 65_536, 131_072, 1_048_576]))


def _scale_count(rng: Random) -> float:
    return float(rng.choice([1e-8, 5e-8, 1e-7, 1e-7, 5e-7]))


def _loop(rng: Random, plant: Plant, peak_n: float, *, has_scale: bool) -> Loop:
    """Draw a P-PI cascade or PID, as fast as the concealed delays between command and force allow."""
    mass_kg = plant.motor_kg + plant.table_kg
    slow_s = plant.delay_s + max(plant.delay_after_step_s, 0.0)
    if plant.current_loop_rad_s > 0.0:
        slow_s += 2.0 * plant.current_loop_damping / plant.current_loop_rad_s
    most = 0.3 / slow_s if slow_s > 0.0 else 1e9
    if plant.has_compliance > 0.0 and plant.contact_power == 1.0:
        most = min(most, 0.25 * math.sqrt(plant.contact_stiffness / mass_kg))
    on_scale = 1.0 if has_scale and rng.random() < 0.4 and plant.backlash_gap_m < 8e-6 else 0.0
    feed = float(rng.choice([0.0, 0.9, 1.0])) * mass_kg
    limit_n = peak_n * rng.uniform(1.8, 3.0)
    if rng.random() < 0.5:
        w = min(2.0 * math.pi * rng.uniform(15.0, 40.0), most)
        kd = mass_kg * w
        return Loop(1.0, on_scale, w / 5.0, kd * w / 6.0, kd, 200.0, plant.viscous_n_s_m, feed, limit_n)
    w = min(2.0 * math.pi * rng.uniform(5.0, 12.0), most / 3.0)
    return Loop(
        0.0, on_scale, 3.0 * mass_kg * w**2, mass_kg * w**3, 3.0 * mass_kg * w, 150.0,
        plant.viscous_n_s_m, feed, limit_n,
    )  # fmt: skip


def _runs(
    rng: Random, lead_m: float, names: tuple[str, ...], *, production: bool, warm: bool
) -> tuple[Run, ...]:
    count = int(rng.integers(2, 7))
    kinds = PRODUCTION if production else TEST
    order = [kinds[i % len(kinds)] for i in range(count)]
    if not production:
        order = [str(kind) for kind in rng.permutation(TEST)][:count] if count <= len(TEST) else order
        if "slow" not in order:
            order[0] = "slow"
        if not {"travel", "speeds"} & set(order):
            order[-1] = "travel"
        if "dwell_dependent_breakaway" in names and "steps" not in order:
            order.append("steps")
    edges = np.linspace(0.0, 1.0, 2 * len(order) + 1)
    heat = np.sqrt(edges) if warm else edges
    return tuple(
        Run(
            kind,
            float(rng.uniform(10.0, 25.0)),
            float(rng.uniform(0.0, lead_m)) if rng.random() < 0.7 else 0.0,
            float(heat[2 * i]),
            float(heat[2 * i + 1]),
            int(rng.integers(2**31)),
        )
        for i, kind in enumerate(order)
    )
