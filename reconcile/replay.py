"""Closed-loop replay: the reference through the known controller onto a model, beside the recording.

Both the nominal and the repaired model are replayed as hil_sim runs them, by its own kernels. Force and
position come out of the loop; nothing of the recording goes in but the reference, where and how fast the axis
started, and what was injected beside the controller.

What comes once a turn has the phase of the encoder's zero. A recording with another zero than that of the
model gets the shift that fits its first seconds best, and nothing else; it is told with the result.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from hil_sim.config import ConfigError, build_plant, load_plant
from reconcile.errors import ReconcileError
from reconcile.model_file import write_model
from reconcile.replay_loop import closed_loop
from reconcile.replay_start import set_off, start_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from reconcile.model_file import NominalModel
    from reconcile.recording import AxisRecording
    from reconcile.replay_controller import Controller

    Array = NDArray[np.float64]

ONCE_A_TURN = ("cogging", "torque_ripple", "lead_error_periodic", "encoder_eccentricity")
ORIGIN_S = 5.0
"""So much of a recording may tell the shift of its zero."""
ORIGINS = 24
"""Shifts tried within a turn before the best is refined."""


class ReplayError(NamedTuple):
    """How far a replay is from its recording."""

    force_rms_n: float
    force_relative: float
    """RMS of the difference over RMS of the recorded force."""
    motor_rms_m: float
    scale_rms_m: float | None


class Replay(NamedTuple):
    """Recorded and replayed, all (n,), SI."""

    source: str
    time_s: Array
    force_n: Array
    replayed_force_n: Array
    motor_m: Array
    replayed_motor_m: Array
    scale_m: Array | None
    replayed_scale_m: Array | None
    origin_m: float
    """Shift of the zero; 0 where it is that of the model."""

    def error(self) -> ReplayError:
        """Over the whole recording."""
        force_rms_n = _rms(self.replayed_force_n - self.force_n)
        scale_rms_m = None
        if self.scale_m is not None and self.replayed_scale_m is not None:
            apart_m = self.replayed_scale_m - self.scale_m
            scale_rms_m = _rms(apart_m - apart_m.mean())  # its zero is its own
        return ReplayError(
            force_rms_n,
            force_rms_n / max(_rms(self.force_n), 1e-300),
            _rms(self.replayed_motor_m - self.motor_m),
            scale_rms_m,
        )


def plant_of(
    model: NominalModel, repairs: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None
) -> PlantConfig:
    """The plant that hil_sim runs: a model file with `repairs`, completed as in `write_model`.

    Raises:
        ReconcileError: hil_sim refuses it.

    """
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory) / "plant.toml"
        write_model(model, repairs or {}, file)
        try:
            return load_plant(file)
        except ConfigError as error:
            raise ReconcileError(model.file, error.key, error.reason) from None


def remaining_delay_s(timing_s: float, period_s: float) -> float:
    """What is to be replayed of a timing that was found: half a period of it is the hold, which is there."""
    return max(timing_s - 0.5 * period_s, 0.0)


def replay(
    recording: AxisRecording,
    plant: PlantConfig,
    controller: Controller,
    *,
    injected_n: Array | None = None,
    delay_s: float = 0.0,
    origin_m: float = 0.0,
) -> Replay:
    """One axis. `injected_n` (n,): force beside the controller; `delay_s`: beside the controller's own.

    Raises:
        ReconcileError: without a reference, or with a sample time that the plant cannot keep.

    """
    period_s, reference_m = controller.period_s, _reference(recording)
    substeps = round(period_s / plant.dt_s)
    if substeps < 1 or not math.isclose(substeps * plant.dt_s, period_s, rel_tol=1e-9):
        where = f"axis.{recording.axis}.controller.sample_time_ms"
        raise ReconcileError(
            plant.name, where, f"is no whole number of plant.substep_us ({plant.substep_us:g})"
        )
    index = list(plant.axes).index(recording.axis)
    built = build_plant(plant)
    if built.params[index]["cross_axis_coupling"]["enabled"]:
        raise ReconcileError(recording.source, f"axis {recording.axis}", "is coupled to another: use the bus")
    count = math.floor(recording.time_s[-1] / period_s + 1e-6) + 1
    instants_s = np.arange(count) * period_s
    reference_m = np.interp(instants_s, recording.time_s, reference_m) + origin_m
    injected = np.zeros(len(recording.time_s)) if injected_n is None else injected_n
    place_m, velocity_m_s = start_of(recording)
    set_off(built.params[index], built.state[index], place_m + origin_m, velocity_m_s)
    window = controller.velocity_samples
    force_n = recording.force_n if recording.force_command_n is None else recording.force_command_n
    rows = closed_loop(
        built.params[index],
        built.state[index],
        built.setpoint[index],
        substeps,
        plant.dt_s,
        round((controller.delay_s + delay_s) / plant.dt_s),
        controller,
        reference_m,
        np.gradient(reference_m, period_s),
        np.interp(instants_s, recording.time_s, injected),
        place_m + origin_m + velocity_m_s * period_s * np.arange(-window, 0.0),
        float(force_n[0]),
    )
    at = np.minimum(np.floor(recording.time_s / period_s + 1e-6).astype(np.int64), count - 1)
    return Replay(
        recording.source,
        recording.time_s,
        force_n,
        rows[at, 0],
        recording.motor_m,
        rows[at, 1] - origin_m,
        recording.scale_m,
        rows[at, 2] - origin_m if plant.axes[recording.axis].scale else None,
        origin_m,
    )


def fitted_origin_m(
    recording: AxisRecording,
    plant: PlantConfig,
    controller: Controller,
    *,
    injected_n: Array | None = None,
    delay_s: float = 0.0,
) -> float:
    """Shift of the recording's zero within a turn, by its first seconds; 0 where the model has no ripple."""
    axis = plant.axes[recording.axis]
    if not any(effect in axis.effects for effect in ONCE_A_TURN):
        return 0.0
    first = recording.time_s <= ORIGIN_S
    short = shortened(recording, first)
    injected_n = None if injected_n is None else injected_n[first]

    def error_n(origin_m: float) -> float:
        tried = replay(
            short, plant, controller, injected_n=injected_n, delay_s=delay_s, origin_m=float(origin_m)
        )
        return tried.error().force_rms_n

    step_m = axis.lead_m / ORIGINS
    best_m = min((step_m * k for k in range(ORIGINS)), key=error_n)
    refined = minimize_scalar(error_n, bounds=(best_m - step_m, best_m + step_m), method="bounded")
    return float(refined.x)


def shortened(recording: AxisRecording, kept: NDArray[np.bool_]) -> AxisRecording:
    """These samples of it alone."""

    def cut(values: Array | None) -> Array | None:
        return None if values is None else values[kept]

    return recording._replace(
        time_s=recording.time_s[kept],
        motor_m=recording.motor_m[kept],
        force_n=recording.force_n[kept],
        scale_m=cut(recording.scale_m),
        reference_m=cut(recording.reference_m),
        temperature_k=cut(recording.temperature_k),
        others={name: values[kept] for name, values in recording.others.items()},
        force_command_n=cut(recording.force_command_n),
    )


def _reference(recording: AxisRecording) -> Array:
    if recording.reference_m is None:
        remedy = "name the position command: --map reference=NAME"
        raise ReconcileError(
            recording.source, f"axis {recording.axis}", "cannot be replayed without a reference", remedy
        )
    return recording.reference_m


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
