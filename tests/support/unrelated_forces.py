"""A rigid axis in realistic motion, whose force has a component that no effect explains."""

import functools
from pathlib import Path

import numpy as np
from concealed_machine import motion
from known_axis import AXIS, COULOMB_N, MASS_KG, VISCOUS_N_S_M
from scipy.signal import butter, sosfiltfilt

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.recording.kinematics import kinematics
from reconcile.recording.recording import AxisRecording
from reconcile.regression.regression_data import regression_data

PERIOD_S = 2e-3
COUNT_M = 1e-8
NOISE_N, NOISE_M = 0.3, 1e-7
UNRELATED_NOISES = 8.0
"""RMS of the unrelated component, in multiples of the noise."""
BAND_HZ = (0.3, 10.0)
BLOCK_S = 0.5
RAD_A_METRE = 80.0
EMPS = Path(__file__).parents[3] / "shared" / "data" / "emps"


@functools.cache
def positions_m(seed: int) -> Array:
    """Return positions (n,): pieces of the test motion between rests at 0, shuffled and scaled."""
    whole_m = motion()[::2]
    rng = np.random.default_rng(1000 + seed)
    stops = np.flatnonzero(np.abs(whole_m) < 1e-12)
    cuts = [0]
    for stop in stops:
        if stop - cuts[-1] > 0.3 / PERIOD_S:
            cuts.append(int(stop))
    pieces = [whole_m[a:b] for a, b in zip(cuts, [*cuts[1:], len(whole_m)], strict=True)]
    order = rng.permutation(len(pieces))
    return np.concatenate([rng.uniform(0.7, 1.3) * rng.choice([-1.0, 1.0]) * pieces[k] for k in order])


def white(seed: int, n: int) -> Array:
    """Return white noise (n,) of unit variance."""
    return np.random.default_rng(seed).normal(size=n)


def smooth(seed: int, n: int) -> Array:
    """Return a band-limited random walk (n,) of unit variance."""
    walk = np.cumsum(white(seed, n + 2000))
    found = sosfiltfilt(butter(2, BAND_HZ, "bandpass", fs=1.0 / PERIOD_S, output="sos"), walk)[1000:-1000]
    return np.asarray(found / found.std())


def of_another_axis(seed: int, n: int) -> Array:
    """Return inertia and friction forces (n,) of an axis in another motion, of unit variance."""
    m = kinematics(np.resize(np.roll(positions_m(seed + 50), 700 + 300 * seed), n), PERIOD_S)
    force_n = 30.0 * m.acceleration_m_s2 + 60.0 * m.velocity_m_s + 8.0 * m.direction
    return np.asarray(force_n / force_n.std())


def shuffled_residual(seed: int, n: int) -> Array:
    """Return shuffled blocks (n,) of a rigid model's residual of a measured axis (EMPS), unit variance."""
    left, block = _measured_residual(), round(BLOCK_S / PERIOD_S)
    blocks = left[: len(left) // block * block].reshape(-1, block)
    rng = np.random.default_rng(2000 + seed)
    return np.resize(np.concatenate([blocks[k] for k in rng.permutation(len(blocks))]), n)


@functools.cache
def _measured_residual() -> Array:
    """Return the residual (n,) of a rigid model, every second sample."""
    with np.load(EMPS / "emps_train.npz") as arrays:
        x, force_n = arrays["q_meas_m"], arrays["force_N"]
    m = kinematics(x, 1e-3)
    rigid = np.stack((m.acceleration_m_s2, m.velocity_m_s, m.direction, np.ones(len(x))), axis=1)
    fitted, *_ = np.linalg.lstsq(rigid[m.moving], force_n[m.moving], rcond=None)
    left = (force_n - rigid @ fitted)[m.moving][::2]
    return np.asarray(left / left.std())


UNRELATED = {
    "white noise": white,
    "smooth random force": smooth,
    "force of another axis": of_another_axis,
    "shuffled residual of a measured axis": shuffled_residual,
}


@functools.cache
def recorded(kind: str, seed: int, *, rotary: bool = False) -> list[RegressionData]:
    """Return two recordings of a rigid axis, with noise and the unrelated component in force and deviation.

    A rotary axis turns by angles that are RAD_A_METRE times as large.
    """
    datasets = []
    for number in range(2):
        own = 10 * seed + number
        x = np.round(positions_m(own) / COUNT_M) * COUNT_M
        m = kinematics(x, PERIOD_S)
        force_n = MASS_KG * m.acceleration_m_s2 + VISCOUS_N_S_M * m.velocity_m_s + COULOMB_N * m.direction
        unrelated = UNRELATED[kind](own, len(x))
        size = 0.0 if kind == "white noise" else UNRELATED_NOISES
        if rotary:
            x = x * RAD_A_METRE
        recording = AxisRecording(
            source=f"run_{number}.csv",
            axis="x",
            period_s=PERIOD_S,
            time_s=np.arange(len(x)) * PERIOD_S,
            motor_m=x,
            force_n=force_n + NOISE_N * (white(own + 500, len(x)) + size * unrelated),
            scale_m=x + NOISE_M * (white(own + 700, len(x)) + size * np.roll(unrelated, 77)),
            reference_m=None,
            temperature_k=293.0 + 8.0 * (1.0 - np.exp(-np.arange(len(x)) * PERIOD_S / 9.0)) + 4.0 * number,
            others={"y": np.roll(positions_m(own + 5), 333) * (RAD_A_METRE if rotary else 1.0)},
        )
        datasets.append(regression_data(recording, AXIS)._replace(rotary=rotary))
    return datasets
