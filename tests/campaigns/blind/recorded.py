"""Writes a case to files: recordings, a nominal model, and the sealed truth."""

import json
import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
from scipy.signal import lfilter

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.axis.record import AT
from tests.campaigns.blind.case import Case, Run, SimulatedRecording
from tests.campaigns.blind.contributions import deviation_m as contribution_m
from tests.campaigns.blind.contributions import known_force_n
from tests.campaigns.blind.motions import set_points
from tests.campaigns.blind.nominal import fitted, model_text
from tests.campaigns.blind.observability import clutter, judged
from tests.campaigns.blind.simulate import run

STEP_S = 2.5e-5
"""Step of the integration, seconds; chosen."""
KELVIN = 293.15
"""Temperature at the start, kelvin (20 degrees Celsius); chosen."""
SEALED = "sealed"


def record(case: Case, directory: Path) -> list[Path]:
    """Write recordings and `model.toml` into `directory`, the truth into its `sealed`; return the former."""
    sealed = directory / SEALED
    sealed.mkdir(parents=True, exist_ok=True)
    recordings = [simulated(case, one) for one in case.runs]
    paths = []
    for number, recording in enumerate(recordings, start=1):
        table = pa.table(recording.columns)
        if case.sensing.as_csv:
            path = directory / f"recording_{number}.csv"
            pyarrow.csv.write_csv(table, path)
        else:
            path = directory / f"recording_{number}.parquet"
            pq.write_table(table, path)
        paths.append(path)
        pq.write_table(pa.table(_concealed(case, recording)), sealed / f"{path.name}.parquet")
    values = fitted([one.columns for one in recordings]) if case.nominal == "fitted" else _data_sheet(case)
    (directory / "model.toml").write_text(model_text(case, values), encoding="utf-8")
    (sealed / "truth.json").write_text(json.dumps(truth(case, recordings), indent=1) + "\n", encoding="utf-8")
    return paths


def _concealed(case: Case, recording: SimulatedRecording) -> dict[str, Array]:
    """Return the contributions of all concealed effects to both residual channels, (n,) each."""
    presliding_n = recording.inside[:, AT["presliding"]]
    deviation_m = sum(contribution_m(case, effect, recording) for effect in case.planted)
    return {
        # all of the friction that does not grow with speed: at rest the sign of the velocity is not a force
        "known_force_n": known_force_n(case, recording.inside)
        - presliding_n
        + recording.inside[:, AT["coulomb_friction_n"]],
        "known_deviation_m": deviation_m + np.zeros(len(recording.inside)),
    }


def truth(case: Case, recordings: list[SimulatedRecording]) -> dict[str, object]:
    """Return the concealed effects with their parameters, and which of them are observable."""
    seen = judged(case, recordings)
    return {
        "seed": case.seed,
        "kind": case.kind,
        "effects": [effect._asdict() | seen[effect.name] for effect in case.planted],
        "clutter": clutter(case, recordings),
        "production": case.production,
        "nominal": case.nominal,
        "sensing": case.sensing._asdict(),
        "plant": case.plant._asdict(),
        "sound": case.sound._asdict(),
        "loop": case.loop._asdict(),
        "runs": [one._asdict() for one in case.runs],
        "lead_m": case.lead_m,
    }


def simulated(case: Case, one: Run) -> SimulatedRecording:
    """Simulate and sense a motion; the gains of an unstable loop are reduced."""
    rng = np.random.default_rng(one.seed)
    period_s, every = case.control_s, round(case.sensing.period_s / case.control_s)
    reference = set_points(one.motion, case.reach, one.duration_s, period_s, rng)
    n, s = len(reference), case.sensing
    rise_share = np.linspace(one.warm_from, one.warm_to, n)
    noise_n = coloured(rng, n, period_s, 15.0) * s.force_drift_n
    wander = coloured(rng, n, period_s, 0.3) * s.scale_wander_m
    motor_noise = rng.normal(size=n) * s.motor_noise_m
    growth = _growth(case, reference[:, 0], rise_share)
    scale_noise = rng.normal(size=n) * s.scale_noise_m + wander + growth
    coupled_m_s2, coupled_columns = _coupled_axis(case, rng, n, period_s)
    loop = case.loop
    for _ in range(6):
        rows = run(
            case.plant,
            loop,
            np.ascontiguousarray(reference),
            period_s,
            STEP_S,
            rise_share=rise_share,
            noise_n=noise_n,
            motor_noise_m=motor_noise,
            scale_noise_m=scale_noise,
            coupled_m_s2=coupled_m_s2,
            start_m=one.start_m,
        )
        if np.abs(rows[:, AT["motor_m"]] - reference[:, 0]).max() < 0.02:
            break
        loop = loop._replace(kp=0.5 * loop.kp, ki=0.25 * loop.ki, kd=0.7 * loop.kd)
    rows = rows[::every]
    columns = {"time_s": np.arange(len(rows)) * s.period_s, "motor_position_m": rows[:, AT["encoder_m"]]}
    if s.is_command:
        force = rows[:, AT["command_n"]]
    else:
        force = rows[:, AT["current_n"]] + rng.normal(size=len(rows)) * s.force_noise_n
        force += coloured(rng, len(rows), s.period_s, 40.0) * s.force_drift_n
    columns["motor_force_n"] = np.round(force / s.force_count_n) * s.force_count_n
    if s.has_scale:
        columns["scale_position_m"] = rows[:, AT["scale_m"]]
    columns["position_command_m"] = reference[::every, 0]
    if s.has_temperature:
        kelvin = KELVIN + case.warming_k * rise_share[::every]
        columns["temperature_k"] = np.round((kelvin + rng.normal(size=len(rows)) * 0.02) / 0.01) * 0.01
    if coupled_columns:
        columns = {
            name if name in {"time_s", "temperature_k"} else f"x.{name}": v for name, v in columns.items()
        }
        columns |= {name: values[::every] for name, values in coupled_columns.items()}
    return SimulatedRecording(columns, rows, wander[::every], growth[::every], one.start_m)


def coloured(rng: np.random.Generator, n: int, period_s: float, corner_hz: float) -> Array:
    """Return noise (n,) of unit RMS behind a first-order low pass."""
    keep = math.exp(-2.0 * math.pi * corner_hz * period_s)
    white = rng.normal(size=n) * math.sqrt(1.0 - keep**2)
    noise: Array = lfilter([1.0], [1.0, -keep], white)
    return noise


def _growth(case: Case, position_m: Array, rise_share: Array) -> Array:
    """Return the thermal growth of the screw from its fixed end."""
    growth: Array = case.expansion_1_k * case.warming_k * rise_share * (position_m - case.fixed_end_m)
    return growth - growth[0]


def _coupled_axis(
    case: Case, rng: np.random.Generator, n: int, period_s: float
) -> tuple[Array, dict[str, Array]]:
    """Return the acceleration of another axis that is coupled to this one, and that axis' columns."""
    if not case.towing:
        return np.zeros(n), {}
    reach = case.reach._replace(travel_m=0.7 * case.reach.travel_m)
    kind = "moves" if case.production else "multisine"
    other = set_points(kind, reach, n * period_s, period_s, rng)[:n]
    mass_kg, friction_n = 30.0, 8.0
    force = mass_kg * other[:, 2] + 60.0 * other[:, 1] + friction_n * np.tanh(other[:, 1] / 1e-4)
    force += rng.normal(size=len(force)) * 0.4
    count_m = 2e-8
    return other[:, 2].copy(), {
        "y.motor_position_m": np.round((other[:, 0] + rng.normal(size=n) * 1e-8) / count_m) * count_m,
        "y.motor_force_n": force,
    }


def _data_sheet(case: Case) -> tuple[float, float, float]:
    """Return mass, viscous and Coulomb friction as on a data sheet."""
    p, (mass, viscous, coulomb) = case.sound, case.nominal_factors
    return (p.motor_kg + p.table_kg) * mass, p.viscous_n_s_m * viscous, p.coulomb_n * coulomb
