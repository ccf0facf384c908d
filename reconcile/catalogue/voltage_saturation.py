"""Voltage saturation: u <= Umax - Ke |v|, so at speed the drive gives less force than commanded.

The law maps the commanded force to the delivered one. Any limit that is low enough would explain an excess of
the command. A limit is therefore tried only if it shows in the delivered force: whenever the command is
beyond it, the motion has the force of the limit, and the missing force is far larger than the residual
elsewhere. A disturbance is as large below the limit as above, and the motion is independent of the limit.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hil_sim.physics.motor import voltage_saturation as physics
from kernels.arrays import Array, rms
from reconcile.catalogue.conversion import IdentifiedTerms, ModelEffect, ModelTerm, PlantValues
from reconcile.catalogue.entry import CatalogueEntry, PlausibleTerm
from reconcile.catalogue.kinds import RegressionData, ShapeParameters, SiParameter, TermFamily

STALL_SHARES = tuple(float(share) for share in np.geomspace(0.3, 4.0, 24))
"""Force at standstill, in the strongest force of the recordings."""
SPEED_SHARES = (0.8, 0.9, 1.05, 1.3, 1.7, 2.5)
"""Speed without load, in the highest speed of the recordings."""
LEAST_CHANGE = 0.1
"""Standard deviation of the speed, in its maximum; at one speed only a limit of the force could be seen."""
MISSING_SHARE = (0.5, 1.5)
"""Bounds of the missing share of the force that is commanded beyond the limit: most of it, about all."""
STANDS_OUT = 3.0
"""What is missing, RMS, over what a rigid model leaves below the limit and off the limit above it; chosen: a
force from outside has 1."""
FEWEST_BEYOND, MOST_BEYOND = 0.002, 0.5
"""Share of the moving samples in which more is asked for than the limit gives."""
FEWEST_SAMPLES = 30
"""The same as a number of samples."""
MOST_SAMPLES = 8000
"""Samples on which limits are compared, evenly taken from the recordings."""
RIDGE = 1e-9
"""Ridge on the rigid fit, as a share of its columns' squares: below a limit they may be collinear."""
MOST_LIMITS = 8
"""Limits to try: those that stand out most."""


class _Samples(NamedTuple):
    """Of all recordings, while the axis moves; (n,) but for `rigid`."""

    speed_m_s: Array
    force_n: Array
    """As recorded, in the direction of the force."""
    driving: NDArray[np.bool_]
    rigid: Array
    """(n, 4) acceleration, velocity, direction and 1, with the sign of the force."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Force at standstill, N, and speed without load, m/s."""
    speeds_m_s = np.abs(np.concatenate([data.motion.velocity_m_s for data in datasets]))
    if float(speeds_m_s.std()) < LEAST_CHANGE * float(speeds_m_s.max()):
        return []
    samples = _samples(datasets)
    strongest_n, fastest_m_s = float(samples.force_n.max(initial=0.0)), float(speeds_m_s.max())
    lines = [(f * strongest_n, v * fastest_m_s) for f in STALL_SHARES for v in SPEED_SHARES]
    ratios = {line: _standing_out(samples, line) for line in lines}
    best = sorted(lines, key=lambda line: ratios[line], reverse=True)[:MOST_LIMITS]
    return [line for line in best if ratios[line] >= STANDS_OUT]


def _samples(datasets: Sequence[RegressionData]) -> _Samples:
    every = max(sum(len(data.time_s) for data in datasets) // MOST_SAMPLES, 1)
    parts = []
    for data in datasets:
        m, sign = data.motion, np.sign(data.force_n)
        rigid = np.stack((m.acceleration_m_s2, m.velocity_m_s, m.direction, np.ones(len(sign))), axis=1)
        driving = sign * m.velocity_m_s > 0.0
        rows = np.column_stack((np.abs(m.velocity_m_s), np.abs(data.force_n), driving, sign[:, None] * rigid))
        parts.append(rows[m.moving][::every])
    rows = np.concatenate(parts)
    return _Samples(rows[:, 0], rows[:, 1], rows[:, 2] > 0.0, rows[:, 3:])


def _available_n(speed_m_s: Array, shape: ShapeParameters) -> Array:
    stall_n, free_m_s = shape
    return np.maximum(stall_n * (1.0 - speed_m_s / free_m_s), 0.0)


def _standing_out(samples: _Samples, shape: ShapeParameters) -> float:
    """What is missing beyond a limit over what a rigid model, fitted below it, leaves on either side."""
    available_n = _available_n(samples.speed_m_s, shape)
    beyond = samples.driving & (samples.force_n > available_n)
    count = np.count_nonzero(beyond)
    if not max(FEWEST_BEYOND * len(beyond), FEWEST_SAMPLES) <= count <= MOST_BEYOND * len(beyond):
        return 0.0
    below = samples.rigid[~beyond], samples.force_n[~beyond]
    gram = below[0].T @ below[0]
    fitted = np.linalg.solve(gram + RIDGE * np.diag(np.diag(gram) + 1.0), below[0].T @ below[1])
    left_n = rms(below[1] - below[0] @ fitted)
    off_limit_n = rms(samples.rigid[beyond] @ fitted - available_n[beyond])
    missing_n = rms(samples.force_n[beyond] - available_n[beyond])
    return missing_n / max(left_n, off_limit_n, 1e-300)


def _refused(found: IdentifiedTerms) -> str:
    shape = found.terms[0]["stall_n"], found.terms[0]["free_m_s"]
    ratio = _standing_out(_samples(found.datasets), shape)
    if ratio >= STANDS_OUT:
        return ""
    return (
        f"what is missing beyond the limit is {ratio:.1f} times what is left elsewhere: a force of any other "
        "origin would look so"
    )


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    v, force_n = data.motion.velocity_m_s, data.force_n
    driving = force_n * v > 0.0  # when it brakes, the back EMF helps
    beyond_n = np.maximum(np.abs(force_n) - _available_n(np.abs(v), shape), 0.0)
    missing_n: Array = np.sign(force_n) * beyond_n * driving
    return missing_n[:, None]


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, SiParameter]:
    return {
        "stall_n": SiParameter(shape[0], "N"),
        "free_m_s": SiParameter(shape[1], "m/s"),
        "missing": SiParameter(float(coefficients[0]), ""),
    }


def _to_plant(found: IdentifiedTerms, _notes: list[str]) -> PlantValues:
    """Stall force Kf Umax / R and speed without load Umax / Kf; Kf is the back-EMF constant too."""
    term, constant_n_a = found.terms[0], found.axis.force_constant_n_a
    limit_v = term["free_m_s"] * constant_n_a
    return {"voltage_limit_v": limit_v, "resistance_v_a": constant_n_a * limit_v / term["stall_n"]}


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """All of the excess is missing."""
    p, constant_n_a = of.params, of.axis.force_constant_n_a
    stall_n, free_m_s = constant_n_a * p.voltage_limit_v / p.resistance_v_a, p.voltage_limit_v / constant_n_a
    return [ModelTerm(of.effect, (stall_n, free_m_s), (1.0,))]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(_columns, _shapes),),
    parameters_of=_parameters,
    sentence=lambda p: (
        f"where force and speed are high together, what is asked for beyond {p['stall_n']:.0f} N less "
        f"{p['stall_n'] / p['free_m_s']:.0f} N per m/s is missing: the amplifier runs out of voltage; a "
        "saturating torque constant would lose it at low speed too"
    ),
    physical=MISSING_SHARE,
    continuous_shape_parameters=2,
    to_plant=_to_plant,
    from_plant=_from_plant,
    refused=_refused,
    shown_by="force is missing only at high speed",
    plausible=lambda sizes: [PlausibleTerm((1.05 * sizes.peak_n, 1.6 * sizes.fastest_m_s), (1.0,))],
    rank=14,
)
