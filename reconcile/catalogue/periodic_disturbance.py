"""A force fixed in time, A sin(2 pi f t): a pump, a fan, another machine."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.ndimage import median_filter

from hil_sim.physics.load import periodic_disturbance as physics
from kernels.arrays import Array
from reconcile.catalogue.conversion import ModelEffect, ModelTerm
from reconcile.catalogue.entry import CatalogueEntry, UnseenTerm
from reconcile.catalogue.kinds import (
    OWN,
    Parameter,
    RegressionData,
    ResidualChannel,
    ShapeParameters,
    TermFamily,
)
from reconcile.catalogue.periodic import amplitude_and_phase, pair, sine_and_cosine, waves

LOWEST_HZ, HIGHEST_HZ = 0.3, 60.0
UNSEEN_HZ = 7.3
"""Of a disturbance that nobody has seen: no multiple of a motion's frequency."""
PEAKS = 8
"""Frequencies to try: those that stand out most."""
FINER = 4
"""Times finer than the longest recording resolves."""
SURROUNDINGS = 101
"""Frequencies that a peak is compared with."""


def _shapes(datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    period_s = datasets[0].period_s
    length = FINER * max(len(data.time_s) for data in datasets)
    power = np.zeros(length // 2 + 1)
    for data in datasets:
        rest_n = np.where(data.motion.moving, data.force_n - data.model_force_n, 0.0)
        rest_n -= rest_n.mean()
        power += np.abs(np.fft.rfft(rest_n * np.hanning(len(rest_n)), length)) ** 2
    frequency_hz = np.fft.rfftfreq(length, period_s)
    height = power / np.maximum(median_filter(power, FINER * SURROUNDINGS, mode="nearest"), 1e-300)
    height[(frequency_hz < LOWEST_HZ) | (frequency_hz > HIGHEST_HZ)] = 0.0
    peaks = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    highest = peaks[np.argsort(height[peaks])[::-1][:PEAKS]]
    return [(float(frequency_hz[peak]),) for peak in highest]


def _columns(data: RegressionData, shape: ShapeParameters) -> Array:
    return pair(2.0 * np.pi * shape[0] * data.time_s)


def _parameters(shape: ShapeParameters, coefficients: Array) -> dict[str, Parameter]:
    """Frequency, amplitude, and the phase in the first recording."""
    return {"frequency_hz": Parameter(shape[0], "Hz"), **amplitude_and_phase(-coefficients, "N")}


def _sentence(p: dict[str, float]) -> str:
    return (
        f"a force of {p['amplitude']:.2f} N at {p['frequency_hz']:.2f} Hz, fixed in time whatever the "
        "speed: a "
        "disturbance from outside; cogging would change its frequency with the speed"
    )


def _from_plant(of: ModelEffect) -> list[ModelTerm]:
    """As if the recording began at power-up, which is how a repaired model has it."""
    p = of.params
    return [
        ModelTerm(
            ENTRY.name, (p.frequency_hz,), sine_and_cosine(-p.amplitude_n, p.phase_rad), ResidualChannel.FORCE
        )
    ]


ENTRY = CatalogueEntry(
    physics=physics,
    terms=(TermFamily(ResidualChannel.FORCE, _shapes, _columns, OWN),),
    parameters=_parameters,
    sentence=_sentence,
    additive=True,
    to_plant=partial(waves, pitch="frequency_hz", amplitude="amplitude_n"),
    from_plant=_from_plant,
    shown_by="its frequency stays at any speed",
    unseen=lambda sizes: [UnseenTerm((UNSEEN_HZ,), (sizes.small_n, 0.0))],
    rank=12,
)
