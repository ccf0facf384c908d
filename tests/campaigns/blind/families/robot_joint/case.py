"""Draw a joint, what it conceals, and its recordings at 1 kHz in rad and N m."""

import math
from collections.abc import Sequence

import numpy as np

from tests.campaigns.blind.families.interface import Array, Case, Channels, Effect, Nominal, plan, sheet
from tests.campaigns.blind.families.robot_joint import trajectories
from tests.campaigns.blind.families.robot_joint.joint import Joint, Law, run

TICK_S = 1e-3
PATHS = (trajectories.stations, trajectories.fourier, trajectories.passes, trajectories.guided)
CLASHES = [
    frozenset({"asymmetric_coulomb_friction", "constant_force"}),
    frozenset({"gravity", "constant_force"}),
    frozenset({"gravity", "position_dependent_friction"}),
    frozenset({"transport_delay", "current_loop_lag"}),
    frozenset({"cogging", "torque_ripple"}),
]
INNER = {"transport_delay", "current_loop_lag"}
"""Between command and current: these cases record the command."""


def concealable(j: Joint, gen: np.random.Generator, fastest: float) -> dict[str, tuple[Joint, Effect]]:
    """Return by name the joint with that effect alone, of a drawn size, and its truth."""
    u = dict(zip("abcdefghijklmn", gen.random(14), strict=True))
    ways = np.sign(gen.random(5) - 0.5)
    lopsided, pull = ways[0] * j.dry * (0.12 + 0.25 * u["a"]), ways[1] * j.dry * (0.3 + 0.8 * u["b"])
    drag, hanging = ways[2] * j.viscous * (0.2 + 0.3 * u["c"]), j.dry * (0.6 + 3.0 * u["d"])
    churn, hum, hertz = (
        j.dry * (0.5 + u["e"]) / fastest**2,
        j.dry * (0.12 + 0.3 * u["f"]),
        3.0 * 9.0 ** u["g"],
    )
    teeth = float(gen.choice([2, 4, 6, 12]))
    harmonic = teeth / j.gear
    detent, uneven = j.dry * (0.15 + 0.35 * u["h"]), 0.03 + 0.08 * u["i"]
    late, lag = int(gen.integers(2, 7)), 0.0015 * 4.0 ** u["j"]
    made = {
        "gravity": (j._replace(hanging=hanging, hanging_rad=6.28 * u["k"]), {"amplitude": hanging}),
        "constant_force": (j._replace(pulled=pull), {"force_n": pull}),
        "asymmetric_coulomb_friction": (j._replace(favour=lopsided), {"force_n": -lopsided}),
        "asymmetric_viscous_friction": (j._replace(favour_viscous=drag), {"half_difference_n_s_m": drag}),
        "stribeck_friction": (
            j._replace(extra=j.dry * (0.4 + 0.6 * u["l"]), extra_rad_s=0.02 * 5.0 ** u["m"]),
            {},
        ),
        "temperature_dependent_friction": (j._replace(grease=0.2 + 0.25 * u["n"]), {}),
        "quadratic_viscous_friction": (j._replace(churn=churn), {"quadratic_n_s2_m2": churn}),
        "position_dependent_friction": (
            j._replace(patch=0.2 + 0.3 * u["a"], patch_rad=0.3 + 0.6 * u["b"]),
            {},
        ),
        "periodic_disturbance": (
            j._replace(hum=hum, hum_hz=hertz),
            {"amplitude": hum, "frequency_hz": hertz},
        ),
        "cogging": (j._replace(detent=detent, teeth=teeth), {"amplitude": detent, "harmonic": harmonic}),
        "torque_ripple": (
            j._replace(uneven=uneven, teeth=teeth),
            {"amplitude": uneven, "harmonic": harmonic},
        ),
        "presliding_hysteresis": (j._replace(bristle_rad=j.bristle_rad * (12.0 + 40.0 * u["c"])), {}),
        "transport_delay": (j._replace(late=late), {"time_s": late * TICK_S}),
        "current_loop_lag": (j._replace(lag_s=lag), {"time_s": lag}),
    }
    pair = ("constant_force", "asymmetric_coulomb_friction")
    also = {"gravity": ("constant_force",)}  # over a limited swing a sine has a mean
    return {
        name: (
            joint,
            Effect(name, known, "force", also.get(name, ()), tuple({*pair} - {name} if name in pair else ())),
        )
        for name, (joint, known) in made.items()
    }


OFFERED = tuple(concealable(Joint(), np.random.default_rng(1), 1.0))


def draw(seed: int, kind: str | None = None, names: Sequence[str] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` in place of what the seed would conceal."""
    gen = np.random.default_rng([5903, seed])
    kind, some = plan(gen, OFFERED, CLASHES, kind)
    some = tuple(names) if names is not None else some
    rotor, link, gear = (
        gen.uniform(0.1, 1.2),
        gen.uniform(0.15, 2.5),
        float(gen.choice([50, 80, 100, 120, 160])),
    )
    dry, viscous = gen.uniform(1.5, 9.0), gen.uniform(0.8, 8.0)
    spring = gen.uniform(0.8e4, 4e4)
    plain = Joint(
        rotor=rotor, link=link, spring=spring, hardening=spring * gen.uniform(1e4, 1e5), viscous=viscous,
        dry=dry,
        damper=0.1 * math.sqrt(spring * rotor * link / (rotor + link)), bristle_rad=gen.uniform(1e-5, 5e-5),
        phase=gen.uniform(0.0, 6.28), gear=gear, count_rad=2.0 * math.pi / 2**16 / gear,
        resolver_rad=gen.uniform(2e-4, 1e-3) / gear,
    )  # fmt: skip
    sweep, fastest = gen.uniform(0.8, 3.5), gen.uniform(0.6, 2.2)
    choice = concealable(plain, gen, fastest)
    whole, w = rotor + link, 2.0 * math.pi * gen.uniform(3.0, 5.5)
    law = Law(whole * w**2, 1.6 * whole * w, whole * w**3 * 0.3, whole, viscous, gen.uniform(10.0, 30.0), 0.5)
    commanded = bool(INNER.intersection(some)) or gen.random() < 0.3
    heated = "temperature_dependent_friction" in some or gen.random() < 0.4
    which = [2, *gen.permutation([0, 1, 3])[: int(gen.integers(1, 4))]]
    sizes = [int(gen.integers(11_000, 18_000)) for _ in which]

    def simulate(acting: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        now = plain
        for name in sorted(acting):
            altered = choice[name][0]
            now = now._replace(
                **{f: a for f, a, b in zip(Joint._fields, altered, plain, strict=True) if a != b}
            )
        everything = []
        for order, (path, n) in enumerate(zip(which, sizes, strict=True)):
            again = np.random.default_rng([5904, seed, order])
            wanted = np.ascontiguousarray(PATHS[path](again, sweep, fastest, n, TICK_S))
            seconds = np.arange(n) * TICK_S
            warmth = (order + seconds / seconds[-1]) / len(which) * heated
            hiss = _noise(again, n, plain)
            outer = hiss[:, 2] * noisy + (foreign[order] if foreign is not None else 0.0)
            rows = run(now, law, wanted, TICK_S, hiss, warmth, outer, noisy)
            told: Channels = {"time": seconds, "motor": rows[:, 0], "force": rows[:, 1 if commanded else 2]}
            told["command"] = wanted[:, 0].copy()
            if heated:
                told["temperature"] = 296.0 + 18.0 * warmth + 0.04 * noisy * again.laplace(size=n)
            everything.append(told)
        return everything

    true = Nominal(whole, viscous, dry, plain.count_rad, gear_ratio=gear)
    hidden = tuple(choice[name][1] for name in some)
    clutter = ("presliding_hysteresis", "encoder_eccentricity", "drive_compliance")
    return Case("robot_joint", seed, kind, sheet(gen, true), true, hidden, simulate, clutter, rotary=True)


def _noise(again: np.random.Generator, n: int, j: Joint) -> Array:
    """Return noise (n, 3): of the resolver, a telegraph and coloured one of the current, a swaying load."""
    flips = np.cumsum(again.random(n) < 0.004) % 2
    wander = np.cumsum(again.normal(size=n) * 0.02)
    wander -= np.convolve(np.pad(wander, 500, mode="edge"), np.full(1001, 1.0 / 1001.0), mode="valid")
    current = 0.02 * j.dry * (flips - 0.5) + 0.015 * j.dry * again.normal(size=n)
    sway = 0.02 * j.dry * wander / max(float(wander.std()), 1e-9)
    return np.column_stack((again.normal(size=n) * 0.5 * j.count_rad, current, sway))
