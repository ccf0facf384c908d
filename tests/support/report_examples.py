"""Inputs of a report: two analysed residuals with known effects, two replays with known errors."""

from pathlib import Path

import numpy as np
from formula_residuals import LEAD_M, MASS_KG, T, data, residual
from numpy.typing import NDArray

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.location.residual_analysis import ResidualAnalysis, analyse_residuals
from reconcile.nominal_model.model_file import load_model
from reconcile.replay.model_replays import ReplayComparison
from reconcile.replay.replay import Replay

HOSTILE = '<script>document.title="broken"</script>'
MODEL = """
[axis.x]
transmission.lead_mm = 5.0
motor.torque_constant_nm_a = 0.4
table.mass_kg = 50.0
"""


def two_analyses(folder: Path) -> list[ResidualAnalysis]:
    """Return the force residuals of two recordings with a ripple, and a deviation with 3 um of backlash."""
    file = folder / "model.toml"
    file.write_text(MODEL, encoding="utf-8")
    axis = load_model(file).axes["x"]

    def ripple_n(s: RegressionData) -> NDArray[np.float64]:
        return np.sin(2.0 * np.pi * s.motion.position_m / LEAD_M)

    ripple = [residual(ripple_n, seed=seed, source=f"{HOSTILE}{seed}") for seed in (0, 1)]
    moved = data()
    play_m = 1.5e-6 * moved.motion.last_direction
    with_scale = moved._replace(scale_m=moved.motion.position_m - play_m)
    noise = residual(of=with_scale, noise=1e-7)
    deviation = noise._replace(measured=noise.after - play_m, before=noise.after - play_m)
    return [
        analyse_residuals("x", ResidualChannel.FORCE, ripple, axis, MASS_KG),
        analyse_residuals("x", ResidualChannel.POSITION_DEVIATION, [deviation], axis, MASS_KG),
    ]


def two_replays() -> list[ReplayComparison]:
    """Return replays of two recordings of 20 s; the nominal model errs by 1 N, from 12 to 14 s by 3 N."""
    time_s = np.arange(20_000) * T
    force_n = 10.0 * np.sin(time_s)
    missed_n = np.where((time_s >= 12.0) & (time_s < 14.0), 3.0, 1.0)
    place_m = np.zeros_like(time_s)

    def run(number: int, wrong_n: NDArray[np.float64], wrong_m: float) -> Replay:
        return Replay(
            source=f"{HOSTILE}{number}",
            time_s=time_s,
            force_n=force_n,
            replayed_force_n=force_n + wrong_n,
            motor_m=place_m,
            replayed_motor_m=place_m + wrong_m,
            scale_m=None,
            replayed_scale_m=None,
            origin_m=0.0,
        )

    return [ReplayComparison("x", run(k, missed_n, 2.8e-6), run(k, 0.1 * missed_n, 7.7e-7)) for k in (0, 1)]
