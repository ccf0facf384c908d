"""Our spectra of residuals beside scipy's and statsmodels', on residuals by formula with a known answer.

Run as `python -m tests.campaigns.bench.spectra_main --json FILE`; decision 0027 has its figures. It runs in
an environment that has statsmodels beside ours (OUT/environment). Samples that are not in use (standstill,
the filter settling) are gaps: the libraries get the samples in use, joined, or the times of those where a
method takes times.
"""

import argparse
import importlib
import importlib.util
import json
import math
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lombscargle, welch

from kernels.arrays import Array
from reconcile.catalogue.kinds import RegressionData
from reconcile.location.locate import in_phase
from reconcile.location.search_bands import over_turns
from reconcile.location.spectra import octaves
from reconcile.location.spectral_lines import find_lines
from reconcile.regression.filter_ends import CORNER_RAD_S, FILTER_HZ
from reconcile.regression.residual import Residual
from reconcile.regression.residual_noise import READ_BAND, spectral_density
from reconcile.regression.state_filter import StateFilter
from reconcile.regression.whiteness import LAGS, SPACING_TIME_CONSTANTS, whiteness
from tests.campaigns.environments import environment
from tests.support.formula_residuals import LEAD_M, NOISE_N, N, T, residual

PACKAGES = ("statsmodels==0.15.0",)
LEVEL = 0.05
STEP = math.ceil(SPACING_TIME_CONSTANTS / CORNER_RAD_S / T)
"""Distance of the samples tested for whiteness, as `whiteness` has it."""
WAVE_N, WAVE_HZ = 2.0, 0.7
"""A slow residual; where samples in use are joined, it has steps."""
LOWEST, HIGHEST = 0.5, 16.0
"""Lines looked for, cycles a turn."""


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return the result of `work`, and its processor time in ms, the least of three."""
    took = []
    for _ in range(3):
        start_s = time.process_time()
        result = work()
        took.append(time.process_time() - start_s)
    return result, round(1e3 * min(took), 2)


def decibels(density: Array, truth: Array, frequency_hz: Array) -> float:
    """Mean error of a density where the levels of noise are fitted, dB."""
    band = (frequency_hz >= READ_BAND[0] * FILTER_HZ) & (frequency_hz <= READ_BAND[1] * FILTER_HZ)
    return round(float(np.mean(10.0 * np.log10(density[band] / truth[band]))), 2)


def density(cases: int) -> dict[str, Any]:
    """Compare the densities: where nothing is missing, and of noise with a slow wave and gaps."""
    one = residual()
    whole = one._replace(used=np.ones(N, dtype=np.bool_))
    (frequency_hz, ours), ours_ms = timed(lambda: spectral_density([whole], [whole.after]))
    n = 2 * (len(frequency_hz) - 1)
    (_, theirs), theirs_ms = timed(lambda: welch(whole.after, 1.0 / T, "hann", n, detrend=False))
    # scipy halves the density at 0 and at Nyquist, which have no mirror
    same = float(np.max(np.abs(ours[1:-1] / theirs[1:-1] - 1.0)))
    errors: dict[str, list[float]] = {"ours": [], "welch, joined": []}
    for seed in range(cases):
        noisy = residual(seed=seed)
        wave = WAVE_N * np.sin(2.0 * math.pi * WAVE_HZ * noisy.data.time_s)
        values = noisy.after + StateFilter(T, FILTER_HZ)(wave)
        found_hz, found = spectral_density([noisy], [values])
        m = 2 * (len(found_hz) - 1)
        truth = 2.0 * T * NOISE_N**2 * filter_gain(found_hz) ** 2
        errors["ours"].append(decibels(found, truth, found_hz))
        _, joined = welch(values[noisy.used], 1.0 / T, "hann", m, detrend=False)
        errors["welch, joined"].append(decibels(joined, truth, found_hz))
    return {
        "largest difference without gaps": same,
        "processor time, ms": {"ours": ours_ms, "welch": theirs_ms},
        "error with gaps, dB": {name: round(float(np.median(of)), 2) for name, of in errors.items()},
    }


def filter_gain(frequency_hz: Array) -> Array:
    """Gain of the state filter, by its impulse response."""
    impulse = np.zeros(2000)
    impulse[1000] = 1.0
    response = StateFilter(T, FILTER_HZ)(impulse)
    phase = np.exp(-2j * math.pi * np.outer(frequency_hz * T, np.arange(2000)))
    gain: Array = np.abs(phase @ response)
    return gain


def white(cases: int) -> dict[str, Any]:
    """Compare the tests for whiteness: equal without gaps; false alarms and what is seen with gaps."""
    diagnostic = importlib.import_module("statsmodels.stats.diagnostic")

    def probability(values: Array) -> float:
        return float(diagnostic.acorr_ljungbox(values, lags=[LAGS])["lb_pvalue"].iloc[0])

    one = residual()
    whole = one._replace(used=np.ones(N, dtype=np.bool_))
    q = whiteness([whole], [whole.after]).q
    theirs = float(diagnostic.acorr_ljungbox(whole.after[::STEP], lags=[LAGS])["lb_stat"].iloc[0])
    alarms = {"ours": 0, "statsmodels, joined": 0}
    seen = dict(alarms)
    for seed in range(cases):
        noisy = residual(seed=seed)
        used = noisy.used[::STEP]
        slow = 0.06 * np.sin(2.0 * math.pi * 1.3 * noisy.data.time_s)
        for values, counts in ((noisy.after, alarms), (noisy.after + slow, seen)):
            counts["ours"] += whiteness([noisy], [values]).probability < LEVEL
            counts["statsmodels, joined"] += probability(values[::STEP][used]) < LEVEL
    return {
        "difference of Q without gaps": abs(theirs / q - 1.0),
        "false alarms": alarms,
        "a wave of 0.06 N seen": seen,
        "cases": cases,
    }


def strongest(one: Residual) -> float:
    """Return the strongest line by Lomb and Scargle over the samples in use, cycles a turn."""
    track = over_turns(one, in_phase(one, one.refitted))
    resolution = 1.0 / float(np.ptp(track.abscissa))
    cycles = np.arange(LOWEST, HIGHEST, 0.25 * resolution)
    power = lombscargle(track.abscissa, track.values, 2.0 * math.pi * cycles, weights=track.weight)
    return float(cycles[int(np.argmax(power))])


def wave(order: float) -> Callable[[RegressionData], Array]:
    """Return a force of so many periods a turn of the screw."""
    return lambda of: 0.15 * np.sin(2.0 * math.pi * order * of.motion.position_m / LEAD_M)


def line(cases: int) -> dict[str, Any]:
    """Compare where a line over the turns of the screw is found, and what is found in noise."""
    bands = octaves(LOWEST, HIGHEST)
    skip = [np.empty(0)] * len(bands)
    found: dict[str, int] = {"ours": 0, "Lomb-Scargle": 0}
    in_noise, took = 0, {"ours": math.inf, "Lomb-Scargle": math.inf}
    for seed in range(cases):
        order = float(np.random.default_rng(seed).uniform(1.0, 6.0))
        lined = residual(wave(order), seed=seed)
        track = over_turns(lined, in_phase(lined, lined.refitted))
        width = 1.0 / float(np.ptp(track.abscissa))
        start_s = time.process_time()
        mine = find_lines([track], bands, skip)
        between_s = time.process_time()
        other = strongest(lined)
        end_s = time.process_time()
        took["ours"] = min(took["ours"], between_s - start_s)
        took["Lomb-Scargle"] = min(took["Lomb-Scargle"], end_s - between_s)
        found["ours"] += bool(mine) and abs(mine[0].cycles - order) < width
        found["Lomb-Scargle"] += abs(other - order) < width
        in_noise += bool(find_lines([over_turns(lined, lined.after)], bands, skip))
    return {
        "found": found,
        "a line of ours in noise": in_noise,
        "processor time, s": {name: round(of, 3) for name, of in took.items()},
        "cases": cases,
    }


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--out", type=Path, default=Path("out/spectra"))
    asked = parser.parse_args()
    if importlib.util.find_spec("statsmodels") is None:
        python = environment(asked.out.resolve() / "environment", PACKAGES, ours=True) / "python"
        command = [str(python), "-m", "tests.campaigns.bench.spectra_main", *sys.argv[1:]]
        sys.exit(subprocess.run(command, check=False).returncode)
    cases = asked.cases
    figures = {"density": density(cases), "whiteness": white(cases), "line": line(cases // 5)}
    print(json.dumps(figures, indent=1))
    if asked.json:
        asked.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
