"""Draw a lift, what it conceals, and its recordings at 1 kHz; the weight is in the model unless concealed."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from tests.campaigns.blind.families.interface import Array, Case, Channels, Effect, Nominal, plan, sheet
from tests.campaigns.blind.families.rack_and_pinion import rides
from tests.campaigns.blind.families.rack_and_pinion.lift import GRAVITY, Cascade, Lift, run

DT = 1e-3
RIDES = (rides.hoist, rides.creep, rides.joystick)
ALIKE = {
    "constant_force": ("asymmetric_coulomb_friction",),
    "asymmetric_coulomb_friction": ("constant_force",),
    "lead_error_periodic": ("encoder_eccentricity",),
}
APART = [
    frozenset({"constant_force", "asymmetric_coulomb_friction"}),
    frozenset({"constant_force", "position_dependent_force"}),
    frozenset({"constant_force", "load_dependent_friction"}),
    frozenset({"cogging", "torque_ripple"}),
]
BETWEEN = {"drive_compliance", "lead_error_cumulative", "lead_error_periodic", "thermal_expansion"}
WARM = {"thermal_expansion", "temperature_dependent_friction"}


def table(
    p: Lift, dice: np.random.Generator, height: float, fastest: float, hung_n: float
) -> dict[str, tuple[dict[str, float], dict[str, float]]]:
    """Return by name the fields of the lift that make an effect, and its true parameters."""

    def side() -> float:
        return float(dice.choice((-1, 1)))

    def part(low: float, high: float) -> float:
        return p.dry_n * dice.uniform(low, high)

    uneven, cog, torque = side() * part(0.12, 0.4), part(0.12, 0.5), dice.uniform(0.02, 0.08)
    cogs, torques = float(dice.choice((4, 8, 12))), float(dice.choice((3, 5, 10)))
    air, pitch, runout = (
        part(0.5, 1.6) / fastest**2,
        side() * dice.uniform(3e-5, 2e-4),
        dice.uniform(6e-6, 4e-5),
    )
    rail = {"rail_n": part(0.2, 0.5), "rail_m": height * dice.uniform(0.1, 0.5)}
    cable = {"cable_n": side() * part(0.4, 1.2), "cable_m": height * dice.uniform(0.2, 1.0)}
    soft = 10.0 ** dice.uniform(-8.0, -7.0)
    return {
        "constant_force": ({"weight_n": hung_n}, {"force_n": -hung_n}),
        "asymmetric_coulomb_friction": ({"up_n": uneven}, {"force_n": -uneven}),
        "load_dependent_friction": ({"by_load": dice.uniform(0.06, 0.2)}, {}),
        "stribeck_friction": ({"static_n": part(0.3, 0.8), "static_m_s": dice.uniform(0.003, 0.02)}, {}),
        "position_dependent_friction": (rail, {}),
        "position_dependent_force": (cable, {}),
        "quadratic_viscous_friction": ({"air": air}, {"quadratic_n_s2_m2": air}),
        "temperature_dependent_friction": ({"oil": dice.uniform(0.18, 0.4)}, {}),
        "cogging": ({"cog_n": cog, "cogs": cogs}, {"amplitude": cog, "harmonic": cogs}),
        "torque_ripple": ({"torque": torque, "torques": torques}, {"amplitude": torque, "harmonic": torques}),
        "drive_compliance": ({"wind_m_n": soft}, {"stiffness_n_m": 1.0 / soft}),
        "lead_error_cumulative": ({"pitch": pitch}, {"relative_error": pitch}),
        "lead_error_periodic": ({"runout_m": runout}, {"amplitude": runout, "harmonic": 1.0}),
        "thermal_expansion": ({"swell_1_k": dice.uniform(0.8e-5, 1.3e-5)}, {}),
    }  # fmt: skip


NAMES = tuple(table(Lift(), np.random.default_rng(0), 1.0, 1.0, 1.0))


def draw(seed: int, kind: str | None = None, names: Sequence[str] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` in place of what the seed would conceal."""
    dice = np.random.default_rng([4507, seed])
    kind, planned = plan(dice, NAMES, APART, kind)
    chosen = list(planned if names is None else names)
    height, fastest = dice.uniform(0.6, 1.8), dice.uniform(0.3, 1.2)
    mass, dry, viscous = dice.uniform(20.0, 160.0), dice.uniform(15.0, 90.0), dice.uniform(40.0, 300.0)
    hung = mass * GRAVITY * dice.uniform(0.1, 0.6)  # what the counterweight leaves
    known = 0.0 if "constant_force" in chosen else hung
    pinion, tape = float(dice.choice((0.1, 0.16, 0.2, 0.32))), float(dice.choice((5e-7, 1e-6, 2e-6)))
    lift = Lift(
        mass_kg=mass, viscous=viscous, dry_n=dry, weight_n=known, pinion_m=pinion,
        phase=dice.uniform(0.0, 6.28),
        count_m=pinion / 2**19, tape_m=tape,
    )  # fmt: skip
    options = table(lift, dice, height, fastest, hung)
    loop = Cascade(
        dice.uniform(12.0, 30.0), mass * dice.uniform(70.0, 130.0), dice.uniform(5.0, 14.0), mass, hung
    )
    has_tape = bool(BETWEEN & {*chosen}) or dice.random() < 0.6
    warms = bool(WARM & {*chosen}) or dice.random() < 0.4
    order = dice.choice(3, size=int(dice.integers(2, 5)))
    order[0] = 1 if "stribeck_friction" in chosen or dice.random() < 0.5 else 0
    samples = [int(s) for s in dice.integers(10_000, 16_000, len(order))]

    def simulate(acting: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        fields = {key: value for name in chosen if name in acting for key, value in options[name][0].items()}
        own, made = lift._replace(**fields), []
        for k, (which, n) in enumerate(zip(order, samples, strict=True)):
            local = np.random.default_rng([4508, seed, k])
            wanted = np.ascontiguousarray(RIDES[which](local, height, fastest, n, DT))
            rise = np.tanh((np.arange(n) * DT + 12.0 * k) / 40.0) if warms else np.zeros(n)
            noise = _noise(local, wanted[:, 1] / fastest, lift)
            rows = run(
                own, loop, wanted, DT, noise, rise, np.zeros(n) if foreign is None else foreign[k], noisy
            )
            run_ = {
                "time": np.arange(n) * DT,
                "motor": rows[:, 0],
                "force": rows[:, 1],
                "command": wanted[:, 0].copy(),
            }
            if has_tape:
                run_ |= {"scale": rows[:, 2]}
            if warms:
                run_ |= {"temperature": 291.0 + 15.0 * rise + noisy * 0.03 * local.standard_normal(n)}
            made.append(run_)
        return made

    true = Nominal(mass, viscous, dry, lift.count_m, tape if has_tape else 0.0, pinion, constant_n=-known)
    effects = tuple(
        Effect(name, options[name][1], "deviation" if name in BETWEEN else "force", alike=ALIKE.get(name, ()))
        for name in chosen
    )
    return Case(
        "rack_and_pinion", seed, kind, sheet(dice, true), true, effects, simulate, ("drive_compliance",)
    )


def _noise(local: np.random.Generator, speed: Array, p: Lift) -> Array:
    """Return noise (n, 3) of encoder, tape and force: the rattle grows with speed, the tape flickers."""
    n = len(speed)
    flicker = np.where(local.random(n) < 0.02, local.choice((-1.0, 1.0), n), 0.0) * p.tape_m
    rattle = lfilter([0.5, 0.5], [1.0], local.standard_normal(n)) * (0.3 + np.abs(speed)) * 0.05 * p.dry_n
    drift = lfilter([0.004], [1.0, -0.9985], local.standard_normal(n)) * 0.35 * p.dry_n
    return np.column_stack((local.uniform(-0.5, 0.5, n) * p.count_m, flicker, rattle + drift))
