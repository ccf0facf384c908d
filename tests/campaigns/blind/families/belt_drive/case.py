"""Draw a belt axis, what it conceals, and its recordings at 500 Hz under a controller of 1 kHz."""

from collections.abc import Sequence

import numpy as np

from tests.campaigns.blind.families.belt_drive import motions
from tests.campaigns.blind.families.belt_drive.axis import Belt, Pid, run
from tests.campaigns.blind.families.interface import Array, Case, Channels, Effect, Nominal, plan, sheet

CONTROL_S, EVERY = 1e-3, 2
KINDS = [motions.pick_and_place, motions.raster, motions.tuning]
OFFERED = (
    "asymmetric_coulomb_friction",
    "asymmetric_viscous_friction",
    "quadratic_viscous_friction",
    "position_dependent_friction",
    "temperature_dependent_friction",
    "constant_force",
    "position_dependent_force",
    "cogging",
    "torque_ripple",
    "periodic_disturbance",
    "drive_compliance",
    "lead_error_cumulative",
    "lead_error_periodic",
)
CONFLICTS = [
    frozenset({"asymmetric_coulomb_friction", "constant_force"}),
    frozenset({"constant_force", "position_dependent_force"}),
    frozenset({"cogging", "torque_ripple"}),
]


DEVIATION = {"drive_compliance", "lead_error_cumulative", "lead_error_periodic"}
ALIKE = {
    "asymmetric_coulomb_friction": ("constant_force",),
    "constant_force": ("asymmetric_coulomb_friction",),
    "lead_error_periodic": ("encoder_eccentricity",),
}


def planted(
    name: str, p: Belt, rng: np.random.Generator, fastest: float, reach: float
) -> tuple[Belt, Effect]:
    """Return the axis with one more effect of drawn size, and its truth."""
    side, share, c = 1.0 if rng.random() < 0.5 else -1.0, rng.uniform(0.0, 1.0), p.coulomb_n
    at, width = rng.uniform(-0.3, 0.3) * reach, rng.uniform(0.1, 0.4) * reach
    wide = {"rail_at_m": at, "rail_m": width}
    few, many, hertz = (
        float(rng.choice([2, 4, 6, 12])),
        float(rng.choice([4, 6, 8, 12])),
        rng.uniform(3.0, 30.0),
    )
    # by name: the true parameter and its size, and which fields of the axis it and others take
    sizes: dict[str, tuple[str, str, float, dict[str, float]]] = {
        "asymmetric_coulomb_friction": ("", "sided_n", side * c * (0.12 + 0.25 * share), {}),
        "asymmetric_viscous_friction": (
            "half_difference_n_s_m", "sided_n_s_m", side * p.viscous * (0.25 + 0.3 * share), {},
        ),
        "quadratic_viscous_friction": ("quadratic_n_s2_m2", "square", c * (0.5 + share) / fastest**2, {}),
        "position_dependent_friction": ("", "rail", side * (0.2 + 0.4 * share), wide),
        "temperature_dependent_friction": ("", "cold", 0.2 + 0.25 * share, {}),
        "constant_force": ("force_n", "incline_n", side * c * (0.3 + share), {}),
        "position_dependent_force": ("", "chain_n_m", c * (0.5 + share) / reach, {}),
        "cogging": ("amplitude", "detent_n", c * (0.15 + 0.3 * share), {"detent_turn": many}),
        "torque_ripple": ("amplitude", "uneven", 0.03 + 0.07 * share, {"uneven_turn": few}),
        "periodic_disturbance": ("amplitude", "shaker_n", c * (0.12 + 0.3 * share), {"shaker_hz": hertz}),
        "drive_compliance": ("", "belt_n", p.belt_n * (0.12 + 0.2 * share), {}),
        "lead_error_cumulative": ("relative_error", "stretch", side * (2e-5 + 2e-4 * share), {}),
        "lead_error_periodic": ("amplitude", "eccentric_m", 1e-5 + 5e-5 * share, {}),
    }  # fmt: skip
    said, field, size, others = sizes[name]
    known = {said: size} if said else {}
    if name == "asymmetric_coulomb_friction":
        known = {"force_n": -size}
    beside = {
        "cogging": ("harmonic", many),
        "torque_ripple": ("harmonic", few),
        "lead_error_periodic": ("harmonic", 1.0),
    }
    beside["periodic_disturbance"] = ("frequency_hz", hertz)
    if name in beside:
        known |= dict([beside[name]])
    also = ("constant_force",) if name == "position_dependent_force" else ()
    side_of = "deviation" if name in DEVIATION else "force"
    return p._replace(**{field: size}, **others), Effect(name, known, side_of, also, ALIKE.get(name, ()))


def draw(seed: int, kind: str | None = None, names: Sequence[str] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` in place of what the seed would conceal."""
    rng = np.random.default_rng([2401, seed])
    kind, chosen = plan(rng, OFFERED, CONFLICTS, kind)
    reach, fastest = rng.uniform(0.3, 0.9), rng.uniform(0.5, 1.6)
    teeth, motor_kg, carriage_kg = int(rng.integers(18, 40)), rng.uniform(1.0, 6.0), rng.uniform(2.0, 18.0)
    coulomb, viscous = rng.uniform(6.0, 35.0), rng.uniform(5.0, 40.0)
    p = Belt(
        pulley_kg=motor_kg, carriage_kg=carriage_kg, belt_n=rng.uniform(2e6, 6e6), half_m=reach,
        damping=rng.uniform(400.0, 1200.0), viscous=viscous, coulomb_n=coulomb,
        dahl_m=rng.uniform(2e-5, 6e-5),
        pulley_m=0.005 * teeth, phase=rng.uniform(0.0, 6.28), encoder_m=0.005 * teeth / 2**17,
        carriage_count_m=float(rng.choice([5e-7, 1e-6])),
    )  # fmt: skip
    sound_axis = p
    found = [planted(name, sound_axis, rng, fastest, reach) for name in (chosen if names is None else names)]
    mass, w = motor_kg + carriage_kg, rng.uniform(40.0, 75.0)
    stiff = p.belt_n / reach * 1.33
    notch = float(np.sqrt(stiff * (1.0 / motor_kg + 1.0 / carriage_kg)) / 6.2832)
    pid = Pid(
        mass * w**2,
        mass * w**3 * 0.2,
        1.6 * mass * w,
        mass * rng.uniform(0.8, 1.1),
        viscous,
        min(notch, 350.0),
        0.8,
    )
    has_carriage_encoder = rng.random() < 0.6 or any(effect.side == "deviation" for _, effect in found)
    warms = rng.random() < 0.4 or any(effect.name.startswith("temperature") for _, effect in found)
    count = int(rng.integers(2, 5))
    order = [KINDS[0], *(KINDS[int(i)] for i in rng.integers(0, 3, count - 1))]
    lengths = [round(rng.uniform(10.0, 18.0) / CONTROL_S / EVERY) * EVERY for _ in order]

    def simulate(acting: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        recordings = []
        q = sound_axis
        for axis, effect in found:
            if effect.name in acting:
                changed = {k: v for k, v in axis._asdict().items() if v != getattr(sound_axis, k)}
                q = q._replace(**changed)
        for index, (motion, n) in enumerate(zip(order, lengths, strict=True)):
            dice = np.random.default_rng([2402, seed, index])
            wanted = np.ascontiguousarray(motion(dice, reach, fastest, n, CONTROL_S))
            t = np.arange(n) * CONTROL_S
            heat = (1.0 - np.exp(-(t + 15.0 * index) / 25.0)) * warms
            load = np.zeros(n)
            if foreign is not None:
                load = np.interp(t, t[::EVERY], foreign[index])
            rows = run(q, pid, wanted, CONTROL_S, _noise(dice, n, sound_axis), heat, load, noisy)[::EVERY]
            one = {
                "time": t[::EVERY],
                "motor": rows[:, 0],
                "force": rows[:, 1],
                "command": wanted[::EVERY, 0],
            }
            if has_carriage_encoder:
                one["scale"] = rows[:, 2]
            if warms:
                shown = 295.0 + 14.0 * heat[::EVERY]
                one["temperature"] = (
                    np.round((shown + dice.normal(size=len(shown)) * 0.05) * 20) / 20 if noisy else shown
                )
            recordings.append(one)
        return recordings

    counts = p.carriage_count_m if has_carriage_encoder else 0.0
    sound = Nominal(mass, viscous, coulomb, p.encoder_m, counts, p.pulley_m)
    return Case(
        "belt_drive", seed, kind, sheet(rng, sound), sound, tuple(effect for _, effect in found), simulate,
        ("presliding_hysteresis", "drive_compliance"), as_csv=seed % 4 == 0,
    )  # fmt: skip


def _noise(dice: np.random.Generator, n: int, p: Belt) -> Array:
    """Return noise (n, 3) of two encoders and the force, its power falling as 1/f (Kasdin 1995)."""
    h = np.cumprod(np.concatenate(([1.0], (np.arange(1, 400) - 0.5) / np.arange(1, 400))))
    pink = np.convolve(dice.normal(size=n + 399), h, mode="valid")[:n]
    shake = dice.normal(size=(n, 2)) * [0.7 * p.encoder_m, 0.7 * p.carriage_count_m]
    return np.column_stack(
        (shake, 0.02 * p.coulomb_n * pink / pink.std() + 0.01 * p.coulomb_n * dice.normal(size=n))
    )
