"""Draw a tilting axis, what it conceals, and its recordings at 500 Hz to 4 kHz in rad and N m."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from tests.campaigns.blind.families.interface import Array, Case, Channels, Nominal, plan
from tests.campaigns.blind.families.tilting_table.cycles import CYCLES
from tests.campaigns.blind.families.tilting_table.hidden import (
    AT_THE_TABLE,
    CONFLICTS,
    RECORDS_ASKED,
    choices,
)
from tests.campaigns.blind.families.tilting_table.loop import Drive, follow
from tests.campaigns.blind.families.tilting_table.trunnion import Trunnion

STEP_S = 1.25e-4
"""Longest step of the equations, s: less than a sixth of the period of the stiffest mesh."""
STIFFEST_HZ = 1200.0
"""Bounds the frequency of shaft against table on the mesh; chosen."""
SLOWEST_LOOP_HZ = 2000.0
"""The drive closes its loops at least so often; a slower recording is each n-th cycle of it."""
MOST_SAMPLES = 36_000
"""Bounds the samples of a recording: at 4 kHz it is short."""
OFFERED = tuple(choices(Trunnion(), np.random.default_rng(0), -1.0, 1.0, 1.0, 10.0))
SMALL = (
    "presliding_hysteresis",
    "drive_compliance",
    "encoder_eccentricity",
    "lead_error_periodic",
    "load_dependent_friction",
)
"""What every machine has a little of: a mesh that rubs, yields and runs out. An inertia above that of the
sheet is a payload as well, for nothing tells the two apart."""


def draw(seed: int, kind: str | None = None, names: Sequence[str] | None = None) -> Case:
    """Draw the case of a seed; `kind` and `names` in place of what the seed would conceal."""
    rng = np.random.default_rng([77_150, seed])
    kind, planned = plan(rng, OFFERED, CONFLICTS, kind)
    concealed = planned if names is None else tuple(names)
    by_worm = bool(rng.random() < 0.6)
    fast = rng.uniform(0.8, 2.2) if by_worm else rng.uniform(1.6, 4.0)
    span = rng.uniform(0.9, 2.4)
    low = -0.5 * span + rng.uniform(-0.5, 0.5)
    table_count = 2.0 * math.pi / 2.0 ** int(rng.integers(18, 21))
    m, most = _machine(rng, by_worm, fast, table_count)
    d = _drive(rng, m, most, table_count)
    found = choices(m, rng, low, low + span, fast, d.speed / d.inertia / (2.0 * math.pi))
    effects = tuple(found[name][1] for name in concealed)
    if "gravity" in concealed and d.observer_1_s == 0.0:  # what the control knows of the weight is rough
        d = d._replace(
            weight=found["gravity"][0]["unbalance"] * rng.uniform(0.6, 0.95),
            weight_rad=found["gravity"][0]["unbalance_rad"] + rng.uniform(-0.15, 0.15),
        )
    has_scale = bool(AT_THE_TABLE.intersection(concealed)) or rng.random() < 0.42
    has_asked = bool(RECORDS_ASKED.intersection(concealed)) or rng.random() < 0.25
    is_warming = "temperature_dependent_friction" in concealed or rng.random() < 0.35
    rate = float(rng.choice([500.0, 1000.0, 2000.0, 4000.0]))
    every = max(round(SLOWEST_LOOP_HZ / rate), 1)
    period_s = 1.0 / rate / every
    chosen = rng.permutation(len(CYCLES))[: 3 if rate > 2000.0 else int(rng.integers(3, 5))]
    lengths = [
        min(round(rng.uniform(10.5, 15.5) * rate), max(round(10.2 * rate), MOST_SAMPLES)) for _ in chosen
    ]
    gain = rng.uniform(0.01, 0.03) * (m.worm_dry + m.seal_dry)

    def simulate(acting: frozenset[str], noisy: bool, foreign: Sequence[Array] | None) -> list[Channels]:
        changed = {field: value for name in acting for field, value in found[name][0].items()}
        now = m._replace(**changed)
        recordings: list[Channels] = []
        for number, (cycle, count) in enumerate(zip(chosen, lengths, strict=True)):
            source = np.random.default_rng([77_151, seed, number])
            n = count * every
            wanted = CYCLES[cycle](source, low, low + span, fast, n, period_s)
            t = np.arange(n) * period_s
            noise = _noise(source, n, period_s, gain, d)
            # the oil warms towards its end by one time constant over all recordings
            warm = 1.0 - np.exp(-(number + t / t[-1]) / len(chosen) * 2.0) if is_warming else np.zeros(n)
            outer = noise[:, 3] * noisy
            if foreign is not None:
                outer = outer + np.repeat(foreign[number], every)
            pieces = max(round(period_s / STEP_S), 1)
            rows = follow(now, d, wanted, period_s, pieces, noise, outer, warm, noisy)[::every]
            kept: Channels = {"time": t[::every], "motor": rows[:, 0].copy()}
            kept["force"] = rows[:, 1 if has_asked else 2].copy()
            if has_scale:
                kept["scale"] = rows[:, 3].copy()
            kept["command"] = wanted[::every, 0].copy()
            if is_warming:
                sensed = 295.0 + 24.0 * warm[::every] + 0.05 * noisy * source.normal(size=count)
                kept["temperature"] = np.round(sensed, 2) if noisy else sensed
            recordings.append(kept)
        return recordings

    sound = Nominal(
        inertia=m.shaft + m.table,
        viscous=m.worm_viscous + m.seal_viscous,
        coulomb=m.worm_dry + m.seal_dry,
        motor_count=d.motor_count,
        scale_count=table_count * has_scale,
        gear_ratio=m.gear,
    )
    sheet = _catalogue_values(rng, sound)
    return Case(
        "tilting_table", seed, kind, sheet, sound, effects, simulate,
        (*SMALL, "payload_mass") if sheet.inertia < sound.inertia else SMALL,
        rotary=True, as_csv=bool(rng.random() < 0.2),
    )  # fmt: skip


def _machine(
    rng: np.random.Generator, by_worm: bool, fast: float, table_count: float
) -> tuple[Trunnion, float]:
    """Return the axis without concealed effects, and the most torque of its motor in N m."""
    gear = float(rng.choice([60, 72, 90, 120] if by_worm else [24, 30, 40, 48]))
    shaft = gear**2 * (rng.uniform(0.8e-3, 2.4e-3) if by_worm else rng.uniform(1.6e-3, 4e-3))
    table, dry = rng.uniform(4.0, 30.0), rng.uniform(30.0, 120.0) if by_worm else rng.uniform(14.0, 50.0)
    viscous = rng.uniform(0.3, 1.0) * dry / fast
    seal = rng.uniform(0.12, 0.3)
    most = 4.0 * dry + (shaft + table) * fast * 14.0 + 350.0
    # the mesh is so stiff that it yields by no more than a count or two of an encoder at the table
    mesh = (seal * dry + table * 6.0 * fast) / table_count / rng.uniform(0.5, 1.5)
    reduced = shaft * table / (shaft + table)
    mesh = min(mesh, (2.0 * math.pi * STIFFEST_HZ) ** 2 * reduced)
    return Trunnion(
        shaft=shaft,
        table=table,
        mesh=mesh,
        mesh_damper=rng.uniform(0.06, 0.15) * math.sqrt(mesh * reduced),
        worm_viscous=(1.0 - seal) * viscous,
        seal_viscous=seal * viscous,
        worm_dry=(1.0 - seal) * dry,
        seal_dry=seal * dry,
        yield_rad=rng.uniform(3e-6, 1.2e-5),
        loss=rng.uniform(0.01, 0.03) if by_worm else rng.uniform(0.002, 0.01),
        saturation=rng.uniform(0.005, 0.03),
        most=most,
        runout_rad=rng.uniform(0.5e-6, 3e-6),
        phase=rng.uniform(0.0, 2.0 * math.pi),
        gear=gear,
    ), most


def _drive(rng: np.random.Generator, m: Trunnion, most: float, table_count: float) -> Drive:
    inertia = (m.shaft + m.table) * rng.uniform(0.85, 1.05)
    speed_hz = rng.uniform(14.0, 30.0)
    resonance_hz = math.sqrt(m.mesh * (1.0 / m.shaft + 1.0 / m.table)) / (2.0 * math.pi)
    return Drive(
        position_1_s=2.0 * math.pi * speed_hz * rng.uniform(0.15, 0.3),
        speed=2.0 * math.pi * speed_hz * inertia,
        reset_s=rng.uniform(4.0, 8.0) / (2.0 * math.pi * speed_hz),
        inertia=inertia,
        speed_filter_hz=rng.uniform(200.0, 350.0),
        notch_hz=resonance_hz if resonance_hz < 0.35 * SLOWEST_LOOP_HZ else 0.0,
        observer_1_s=2.0 * math.pi * speed_hz * 0.2 if rng.random() < 0.5 else 0.0,
        weight=0.0,
        weight_rad=0.0,
        most=most,
        step=2.0 * most / 2.0 ** int(rng.integers(12, 15)),
        motor_count=2.0 * math.pi / 2.0 ** int(rng.integers(18, 23)) / m.gear,
        table_count=table_count,
    )


def _noise(rng: np.random.Generator, n: int, period_s: float, gain: float, d: Drive) -> Array:
    """Return noise (n, 4): of both encoders in rad, of the current and of coolant on the table in N m.

    The current's is a resonance of the filter of its sensor beside a low pass, the coolant's a low pass.
    """
    white = rng.normal(size=(4, n))
    turn = 2.0 * math.pi * 150.0 * period_s
    ringing = lfilter([1.0], [1.0, -2.0 * 0.9 * math.cos(turn), 0.81], white[2])
    low = math.exp(-2.0 * math.pi * 4.0 * period_s)
    jets = lfilter([math.sqrt(1.0 - low * low)], [1.0, -low], white[3])
    current = gain * (0.7 * ringing / float(ringing.std()) + 0.7 * rng.normal(size=n))
    return np.column_stack(
        (0.4 * d.motor_count * white[0], 0.7 * d.table_count * white[1], current, 0.7 * gain * jets)
    )


def _catalogue_values(rng: np.random.Generator, sound: Nominal) -> Nominal:
    """Return a maker's values: the inertia 10 to 30 % wrong, its friction up to 30 %."""
    wrong = 1.0 + float(rng.choice([-1.0, 1.0])) * rng.uniform(0.1, 0.3)
    viscous, coulomb = rng.uniform(0.7, 1.3), rng.uniform(0.7, 1.3)
    return Nominal(
        inertia=sound.inertia * wrong,
        viscous=sound.viscous * viscous,
        coulomb=sound.coulomb * coulomb,
        motor_count=sound.motor_count,
        scale_count=sound.scale_count,
        gear_ratio=sound.gear_ratio,
    )
