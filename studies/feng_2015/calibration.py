"""Calibration of machines/xy_table against the published figures of Feng et al. 2015.

    python -m studies.feng_2015.calibration            the sixteen relative errors of the machine as it stands
    python -m studies.feng_2015.calibration --refit N  a search over N generations, printed, not written

The batch twin runs the circle program of the machine, and the analysis of the experiment computes the
indicators, so the figures equal those of the same program on the bus. The free parameters, and why their
values are plausible: docs/decisions/0003-xy-table-calibration.md.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.optimize import Bounds, differential_evolution

from hil_sim.config import PlantConfig
from hil_sim.physics.friction import presliding_gms
from kernels.arrays import Array
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.metrology.circles import ReversalFigures, analyse_circles, figures_um
from servo_ctrl.recording.reader import Recording
from studies.feng_2015.published import FENG_2015_X_UNCOMPENSATED, relative_errors_percent
from studies.feng_2015.twin_motions import TwinProgram, twin_program
from twin.plant_file import load_plant
from twin.rollout import rollout

MACHINE = Path(__file__).parents[2] / "machines" / "xy_table"
AXIS = "x"
LARGEST_WEIGHT = 0.15
"""Weight of the largest error beside the RMS, so that no single figure is sacrificed; chosen."""
SMOOTH_SAMPLES = 21
"""Samples of the moving average from which the ripple is measured; chosen."""
RIPPLE_LIMIT_M = 0.1e-6
"""RMS ripple without a penalty: the figures must not come from a loop close to limit cycles; chosen."""
LAG_LIMIT_M = 1.2e-6
"""Error before a reversal without a penalty: no friction compensation could remove it; chosen."""
LATEST_PEAK = 0.7
"""Latest peak of the error, share of the window: the window must not cut the rising edge; chosen."""
PENALTY = 0.3
"""Weight of each excess in the misfit; chosen."""
ELEMENTS = 6
"""Presliding elements in use; chosen."""


class FreeParameter(NamedTuple):
    """A parameter of the search, which runs over its logarithm; both bounds are positive."""

    name: str
    lower: float
    upper: float


FREE_PARAMETERS = (
    FreeParameter("table_kg", 30.0, 60.0),
    FreeParameter("coulomb_n", 8.0, 90.0),
    FreeParameter("stribeck_share", 0.03, 0.6),
    FreeParameter("stribeck_mm_s", 1.0, 20.0),
    FreeParameter("viscous_n_s_m", 30.0, 250.0),
    FreeParameter("first_slip_um", 0.5, 5.0),
    FreeParameter("last_slip_um", 5.0, 120.0),
    FreeParameter("shape", 0.1, 10.0),  # share of an element ~ (slip distance)^log(shape)
    FreeParameter("attraction_n_s", 300.0, 1e5),
    FreeParameter("micro_damping_n_s_m", 100.0, 2e4),
    FreeParameter("velocity_bandwidth_1_s", 120.0, 280.0),  # kv / moved mass: 2 ms of delay allow no more
    FreeParameter("integral_share", 0.02, 0.28),  # ki / kv per velocity bandwidth
    FreeParameter("position_share", 0.05, 0.28),  # kp per velocity bandwidth
    FreeParameter("window_s", 0.06, 0.5),
)


def circle_program(machine: MachineConfig) -> TwinProgram:
    """Return the commands of the machine's `programs/circles.toml`."""
    return twin_program(machine, load_program(machine.source.parent / "programs" / "circles.toml", machine))


class Measured(NamedTuple):
    """Indicators (um) of the x axis by feed (mm/min), and measures of a bad loop, in the batch twin."""

    figures: dict[int, ReversalFigures]
    ripple_m: float
    """RMS of the error on the slowest circle less its moving average."""
    lag_m: float
    """Largest mean error just before the reversal, over the circles."""
    latest_peak: float
    """Share of the window after which the error peaks on the slowest circle, 0 to 1."""


def measured(machine: MachineConfig, plant: PlantConfig, program: TwinProgram) -> Measured:
    """Run the circle program through the batch twin."""
    params = {name: axis_params(machine, name) for name in machine.axes}
    columns = rollout(machine, plant, params, program.reference)
    recording = Recording(machine.source.parent, program.header, {**columns, "segment": program.segment})
    results = analyse_circles(recording, machine.monitoring.window_s)
    figures = {result.feed_mm_min: figures_um(result.indicators[AXIS]) for result in results}
    traces = [result.error_traces[AXIS] for result in results]
    trace = traces[0]
    inside = (trace.since_reversal_s >= 0.0) & (trace.since_reversal_s < machine.monitoring.window_s)
    peak_s = float(trace.since_reversal_s[inside][np.argmax(np.abs(trace.error_m[inside]))])
    error_m = recording.segment(results[0].label)[f"{AXIS}.position_error_m"]
    ripple_m = error_m - uniform_filter1d(error_m, SMOOTH_SAMPLES)
    lag_m = max(float(np.mean(np.abs(t.error_m[t.since_reversal_s < 0.0]))) for t in traces)
    return Measured(figures, float(np.std(ripple_m)), lag_m, peak_s / machine.monitoring.window_s)


def with_values(
    machine: MachineConfig, plant: PlantConfig, values: dict[str, float]
) -> tuple[MachineConfig, PlantConfig]:
    """Return controller and plant with these values of the free parameters of the x axis."""
    axis = plant.axes[AXIS]
    effects = dict(axis.effects)
    breakaway_n = values["coulomb_n"] * (1.0 + values["stribeck_share"])
    effects["coulomb_friction"] = effects["coulomb_friction"]._replace(coulomb_n=values["coulomb_n"])
    effects["stribeck_friction"] = effects["stribeck_friction"]._replace(
        stribeck_n=values["stribeck_share"] * values["coulomb_n"], stribeck_m_s=values["stribeck_mm_s"] * 1e-3
    )
    effects["viscous_friction"] = effects["viscous_friction"]._replace(viscous_n_s_m=values["viscous_n_s_m"])
    slip_m = np.geomspace(values["first_slip_um"], values["last_slip_um"], ELEMENTS) * 1e-6
    share = (slip_m / slip_m[-1]) ** np.log(values["shape"])
    share /= share.sum()
    unused = (0.0,) * (presliding_gms.ELEMENTS_MAX - ELEMENTS)
    effects["presliding_gms"] = effects["presliding_gms"]._replace(
        share=(*share.tolist(), *unused),
        stiffness_n_m=(*(share * breakaway_n / slip_m).tolist(), *unused),
        attraction_n_s=values["attraction_n_s"],
        micro_damping_n_s_m=values["micro_damping_n_s_m"],
    )
    table = axis.table.model_copy(update={"mass_kg": values["table_kg"]})
    axis = axis.model_copy(update={"effects": effects, "table": table})
    plant = plant.model_copy(update={"axes": {**plant.axes, AXIS: axis}})

    moved_kg = values["table_kg"] + axis.motor_mass_kg
    bandwidth_1_s = values["velocity_bandwidth_1_s"]
    gains = {
        "kp_1_s": values["position_share"] * bandwidth_1_s,
        "kv_n_s_m": moved_kg * bandwidth_1_s,
        "ki_n_m": moved_kg * bandwidth_1_s**2 * values["integral_share"],
        "velocity_feedforward": 1.0,
        "acceleration_feedforward_kg": moved_kg,
    }
    servo = machine.axes[AXIS]
    servo = servo.model_copy(update={"control": servo.control.model_copy(update=gains)})
    monitoring = machine.monitoring.model_copy(update={"window_s": values["window_s"]})
    machine = machine.model_copy(update={"axes": {**machine.axes, AXIS: servo}, "monitoring": monitoring})
    return machine, plant


def misfit(found: Measured) -> float:
    """Return the misfit: RMS of the sixteen logarithmic errors, a share of the largest, and penalties.

    The penalties are for ripple, lag, and a peak at the end of the window.
    """
    pairs = [(found.figures[feed], published) for feed, published in FENG_2015_X_UNCOMPENSATED.items()]
    errors = np.log([np.divide(ours, published) for ours, published in pairs])
    ripple = max(0.0, found.ripple_m / RIPPLE_LIMIT_M - 1.0)
    lag = max(0.0, found.lag_m / LAG_LIMIT_M - 1.0)
    cut = max(0.0, found.latest_peak - LATEST_PEAK)
    return float(
        np.sqrt(np.mean(errors**2)) + LARGEST_WEIGHT * np.abs(errors).max() + PENALTY * (ripple + lag + cut)
    )


def refit(machine: MachineConfig, plant: PlantConfig, generations: int, seed: int) -> dict[str, float]:
    """Return the free parameters of least misfit, found by differential evolution."""
    program = circle_program(machine)
    lower = np.log([free.lower for free in FREE_PARAMETERS])
    upper = np.log([free.upper for free in FREE_PARAMETERS])

    def values_at(point: Array) -> dict[str, float]:
        numbers = np.exp(lower + point * (upper - lower)).tolist()
        return dict(zip((free.name for free in FREE_PARAMETERS), numbers, strict=True))

    def cost(point: Array) -> float:
        found = misfit(measured(*with_values(machine, plant, values_at(point)), program))
        return found if np.isfinite(found) else 1e3

    result = differential_evolution(
        cost,
        Bounds(np.zeros(len(FREE_PARAMETERS)), np.ones(len(FREE_PARAMETERS))),
        maxiter=generations,
        popsize=6,
        tol=0.0,
        rng=seed,
        polish=False,
    )
    return values_at(result.x)


def table(figures: dict[int, ReversalFigures]) -> str:
    """Return a text table of the sixteen figures, the published ones, and their relative errors."""
    lines = ["F mm/min   contour peak           mean |e|               peak |e|               RMS"]
    errors = relative_errors_percent(figures)
    for feed, published in FENG_2015_X_UNCOMPENSATED.items():
        cells = [
            f"{ours:6.2f} {theirs:6.2f} {error:+5.1f}%"
            for ours, theirs, error in zip(figures[feed], published, errors[feed], strict=True)
        ]
        lines.append(f"{feed:8d}   " + "  ".join(cells))
    every = np.array([list(row) for row in errors.values()])
    lines.append(f"RMS {np.sqrt(np.mean(every**2)):.1f} %, largest {np.abs(every).max():.1f} %")
    return "\n".join(lines)


def main() -> None:
    """Print the sixteen errors; refit on demand."""
    parser = argparse.ArgumentParser(description="The X-Y table against the published figures.")
    parser.add_argument("--refit", type=int, default=0, metavar="N", help="generations of a new search")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    machine, plant = load_machine(MACHINE), load_plant(MACHINE)
    if options.refit:
        values = refit(machine, plant, options.refit, options.seed)
        print("\n".join(f"{name} = {value:.6g}" for name, value in values.items()))  # noqa: T201 a script
        machine, plant = with_values(machine, plant, values)
        print(*plant.axes[AXIS].effects.values(), machine.axes[AXIS].control, sep="\n")  # noqa: T201 a script
    print(table(measured(machine, plant, circle_program(machine)).figures))  # noqa: T201 a script


if __name__ == "__main__":
    main()
