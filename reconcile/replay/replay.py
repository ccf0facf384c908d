"""Closed-loop replay: drive a model by the recorded reference and the known controller.

The loop computes force and position; the recording contributes only the reference, the initial position and
velocity, and the force that was injected beside the controller. The physics are hil_sim's own kernels.

Cogging, lead errors and other effects that repeat with the screw have a phase relative to the encoder's zero.
A recording whose encoder zero differs from the model's is shifted by the distance that fits its first seconds
best; the shift is part of the result.
"""

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from hil_sim.config import ConfigError, PlantConfig, build_plant, load_plant
from kernels.arrays import Array, rms
from reconcile.catalogue.registry import CATALOGUE
from reconcile.errors import ReconcileError
from reconcile.nominal_model.model_file import NominalModel, write_model
from reconcile.recording.first_sample import initial_motion, set_initial_motion
from reconcile.recording.recording import AxisRecording
from reconcile.replay.closed_loop import FORCE, MOTOR, SCALE, closed_loop
from reconcile.replay.controller import Controller

FIXED_TO_SCREW = frozenset(name for name, entry in CATALOGUE.items() if entry.fixed_to_screw)
ORIGIN_FIT_S = 5.0
"""Length of the beginning of a recording to which the shift of its encoder zero is fitted; chosen."""
ORIGINS_PER_TURN = 24
"""Shifts tried before the best is refined. Chosen: two for each period of a twelfth harmonic."""


class ReplayError(NamedTuple):
    """RMS differences between a replay and its recording."""

    force_rms_n: float
    force_relative: float
    """RMS of the force difference over the RMS of the recorded force."""
    motor_rms_m: float
    scale_rms_m: float | None


class Replay(NamedTuple):
    """A recording beside its replay, all arrays (n,), SI."""

    source: str
    time_s: Array
    force_n: Array
    replayed_force_n: Array
    motor_m: Array
    replayed_motor_m: Array
    scale_m: Array | None
    replayed_scale_m: Array | None
    origin_m: float
    """Shift of the encoder zero against the model's."""

    def error(self) -> ReplayError:
        """Compare over the whole recording; the scale's mean difference is its zero and is removed."""
        scale_rms_m, force_rms_n = None, rms(self.replayed_force_n - self.force_n)
        if self.scale_m is not None and self.replayed_scale_m is not None:
            difference_m = self.replayed_scale_m - self.scale_m
            scale_rms_m = rms(difference_m - difference_m.mean())
        relative = force_rms_n / max(rms(self.force_n), 1e-300)
        return ReplayError(force_rms_n, relative, rms(self.replayed_motor_m - self.motor_m), scale_rms_m)


def plant_of(
    model: NominalModel, updates: Mapping[str, Mapping[str, Mapping[str, Any]]] | None = None
) -> PlantConfig:
    """Load a model file with `updates` (axis, section, values) as the plant that hil_sim runs.

    Raises:
        ReconcileError: hil_sim refuses the plant.

    """
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory) / "plant.toml"
        write_model(model, updates or {}, file)
        try:
            return load_plant(file)
        except ConfigError as error:
            raise ReconcileError(model.file, error.key, error.reason) from None


def remaining_delay_s(timing_s: float, period_s: float) -> float:
    """Return the identified delay less the half period that the loop's zero-order hold adds by itself."""
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
    """Replay one axis of a recording.

    `injected_n` (n,) is a force beside the controller, `delay_s` is added to the controller's own delay,
    `origin_m` is the position of the recording's encoder zero in the model.

    Raises:
        ReconcileError: no reference was recorded, the axis is coupled to another, or the sample time is not a
            whole number of the plant's substeps.

    """
    period_s, where = controller.sample_time_s, f"axis {recording.axis}"
    if recording.reference_m is None:
        remedy = "name the position command: --map reference=NAME"
        raise ReconcileError(recording.source, where, "cannot be replayed without a reference", remedy)
    substeps = round(period_s / plant.dt_s)
    if substeps < 1 or not math.isclose(substeps * plant.dt_s, period_s, rel_tol=1e-9):
        reason = f"is not a whole number of plant.substep_us ({plant.substep_us:g})"
        raise ReconcileError(plant.name, f"axis.{recording.axis}.controller.sample_time_ms", reason)
    index = list(plant.axes).index(recording.axis)
    built = build_plant(plant)
    if any("other" in params._fields for params in plant.axes[recording.axis].effects.values()):
        raise ReconcileError(recording.source, where, "is coupled to another: use the bus")
    count = math.floor(recording.time_s[-1] / period_s + 1e-6) + 1
    instants_s = np.arange(count) * period_s
    reference_m = np.interp(instants_s, recording.time_s, recording.reference_m) + origin_m
    injected = np.zeros(len(recording.time_s)) if injected_n is None else injected_n
    position_m, velocity_m_s = initial_motion(recording)
    set_initial_motion(built.params[index], built.state[index], position_m + origin_m, velocity_m_s)
    window = controller.velocity_samples
    force_n = recording.force_n if recording.force_command_n is None else recording.force_command_n
    rows = closed_loop(
        p=built.params[index],
        s=built.state[index],
        sp=built.setpoint[index],
        substeps=substeps,
        dt_s=plant.dt_s,
        delay=round((controller.delay_s + delay_s) / plant.dt_s),
        controller=controller,
        reference_m=reference_m,
        reference_velocity_m_s=np.gradient(reference_m, period_s),
        injected_n=np.interp(instants_s, recording.time_s, injected),
        earlier_motor_m=position_m + origin_m + velocity_m_s * period_s * np.arange(-window, 0.0),
        earlier_force_n=float(force_n[0]),
    )
    at = np.minimum(np.floor(recording.time_s / period_s + 1e-6).astype(np.int64), count - 1)
    return Replay(
        source=recording.source,
        time_s=recording.time_s,
        force_n=force_n,
        replayed_force_n=rows[at, FORCE],
        motor_m=recording.motor_m,
        replayed_motor_m=rows[at, MOTOR] - origin_m,
        scale_m=recording.scale_m,
        replayed_scale_m=rows[at, SCALE] - origin_m if plant.axes[recording.axis].scale else None,
        origin_m=origin_m,
    )


def fitted_origin_m(
    recording: AxisRecording,
    plant: PlantConfig,
    controller: Controller,
    *,
    injected_n: Array | None = None,
    delay_s: float = 0.0,
) -> float:
    """Fit the shift of a recording's encoder zero within a turn; 0 if no effect of the plant has a phase."""
    axis = plant.axes[recording.axis]
    if FIXED_TO_SCREW.isdisjoint(axis.effects):
        return 0.0
    first = recording.time_s <= ORIGIN_FIT_S
    beginning = shortened(recording, first)
    injected_n = None if injected_n is None else injected_n[first]

    def error_n(origin_m: float) -> float:
        trial = replay(
            beginning, plant, controller, injected_n=injected_n, delay_s=delay_s, origin_m=float(origin_m)
        )
        return trial.error().force_rms_n

    step_m = axis.lead_m / ORIGINS_PER_TURN
    best_m = min((step_m * k for k in range(ORIGINS_PER_TURN)), key=error_n)
    refined = minimize_scalar(error_n, bounds=(best_m - step_m, best_m + step_m), method="bounded")
    return float(refined.x)


def shortened(recording: AxisRecording, kept: NDArray[np.bool_]) -> AxisRecording:
    """Return the recording with the samples of the mask `kept` (n,) only."""
    fields = recording._asdict().items()
    channels: dict[str, Any] = {name: of[kept] for name, of in fields if isinstance(of, np.ndarray)}
    others = {name: values[kept] for name, values in recording.others.items()}
    return recording._replace(**channels, others=others)
