"""EMPS, a real ball-screw axis: Janot, Gautier, Brunot, "Data Set and Reference Models of EMPS", 2019.

Two records of one motion at 1 kHz: DATA_EMPS, and DATA_EMPS_PULSES with a force injected beside the
controller. The diagnosis begins with a rigid model of one mass, one viscous and one symmetric Coulomb value,
fitted on the first record. What it finds there is then judged on the second, which it has not seen; a second
diagnosis has both.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import tomli_w

from reconcile import example_pictures as pictures
from reconcile.diagnose import diagnose
from reconcile.example import Shown, data_file, reports, write_figures
from reconcile.example_emps_table import CLOSED_LOOP, closed_loop, found, held_out
from reconcile.example_record import ONCE_A_TURN, TwoRecords
from reconcile.formats.mapping import parse_mapping
from reconcile.formats.readers import read_table
from reconcile.kinematics import kinematics
from reconcile.model_file import load_model
from reconcile.recording import ReadOptions, load_recordings
from reconcile.replay import fitted_origin_m, plant_of, remaining_delay_s, replay
from reconcile.replay_controller import controller_of, load_controllers
from reconcile.scenes import FILTER_HZ
from reconcile.state_filter import StateFilter
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from reconcile.example_record import Effect
    from reconcile.explain import Explanation
    from reconcile.recording import AxisRecording
    from reconcile.replay import Replay

    Array = NDArray[np.float64]

NAME = "emps"
TITLE = "EMPS, a real ball-screw axis (Janot, Gautier, Brunot 2019)"
RECORDS = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
PUBLISHER = (
    "the data are published by A. Janot, M. Gautier and M. Brunot at https://www.nonlinearbenchmark.org "
    '("EMPS"): put DATA_EMPS.mat and DATA_EMPS_PULSES.mat there, or say where they are with --data'
)
MAPPING = ("time=t", "position=qm", "voltage=vir", "reference=qg", "force_per_volt=gtau")
AXIS = "x"
LEAD_M, COUNTS, LIMIT_V, VELOCITY_SAMPLES = 2.5e-3, 50_000, 10.0, 2
"""Of the description: the screw, the encoder, the controller's limit, its two-tap mean and difference."""
REJECTED = "position_dependent_friction"


class _Inputs(NamedTuple):
    recordings: list[AxisRecording]
    injected_n: list[Array]
    nominal: Path
    values: dict[str, float]


def run(data: Path, out: Path, on_progress: Callable[[str], None]) -> Shown:
    """Both diagnoses, the held-out record and the replays. Raises ReconcileError."""
    paths = [data_file(data, [name], PUBLISHER) for name in RECORDS]
    out.mkdir(parents=True, exist_ok=True)
    inputs = _inputs(paths, out)
    options = ReadOptions(parse_mapping(MAPPING))
    first = diagnose(paths[:1], inputs.nominal, out / "train", options, on_progress)
    both = diagnose(paths, inputs.nominal, out / "both", options, on_progress)
    force = first.explanations[AXIS][0]
    effects: list[Effect] = [(c.effect, c.shape) for finding in force.findings for c in finding.candidates]
    timing: list[Effect] = [force.timing] if force.timing else []
    effects = [*timing, *effects]
    on_progress("the record that was held out")
    train, other = inputs.recordings
    records = TwoRecords(train, other, load_model(inputs.nominal).axes[AXIS])
    stages = records.stages(effects)
    loser = records.loser(REJECTED, effects) if REJECTED not in dict(effects) else None
    ripples = records.ripples(effects) if any(name in ONCE_A_TURN for name, _ in effects) else []
    on_progress("closed-loop replay")
    replays = _replays(inputs, first.model_file, force)
    values = {
        "nominal": inputs.values,
        "named": {
            "train": [finding["effect"] for finding in first.verdict["findings"]],
            "both": [finding["effect"] for finding in both.verdict["findings"]],
        },
        "timing_s": force.timing_s,
        "stages": [stage._asdict() for stage in stages],
        "blocks_n": {
            "train": first.verdict["fit"][AXIS]["force"],
            "both": both.verdict["fit"][AXIS]["force"],
        },
        "rejected": loser._asdict() if loser else None,
        "ripples": [ripple._asdict() for ripple in ripples],
        "replay": {
            record: {model: one.error()._asdict() for model, one in pair.items()}
            for record, pair in replays.items()
        },
        "origin_m": replays["pulses"]["repaired"].origin_m,
    }
    files = [write_figures(out, values), first.model_file, *reports(first.verdict_file, both.verdict_file)]
    if ripples:
        turns = (records.orders(effects), ripples)
        files.append(pictures.emps(out / "emps.png", force.rests[0], turns, replays, CLOSED_LOOP))
    rows = [*found(values, first.verdict["findings"]), *held_out(stages, loser), *closed_loop(replays)]
    return Shown(TITLE, rows, values, files)


def _inputs(paths: list[Path], out: Path) -> _Inputs:
    """The records, what was injected, and the model to begin with."""
    tables = [read_table(path, parse_mapping([]), {}).columns for path in paths]
    force_per_volt = float(tables[0]["gtau"].values[0])
    axis: dict[str, Any] = {
        "transmission": {"lead_mm": LEAD_M * 1e3},
        # 1 A stands for 1 V: the data know the motor by its force per volt alone
        "motor": {"torque_constant_nm_a": force_per_volt * LEAD_M / (2.0 * math.pi)},
        "encoder": {"counts_per_rev": COUNTS},
        "table": {"mass_kg": 1.0},
    }
    controller = {
        "form": "cascade",
        "sample_time_ms": 1.0,
        "position_gain_1_s": float(tables[0]["kp"].values[0]),
        "velocity_gain_n_s_m": float(tables[0]["kv"].values[0]) * force_per_volt,
        "velocity_samples": VELOCITY_SAMPLES,
        "force_limit_n": LIMIT_V * force_per_volt,
    }
    nominal = out / "nominal.toml"
    _write(nominal, axis, controller)
    options = ReadOptions(parse_mapping(MAPPING))
    recordings = load_recordings(paths, load_model(nominal).axes, options)
    values = fitted_rigid(recordings[0])
    axis["table"] = {"mass_kg": values["mass_kg"]}
    axis["viscous_friction"] = {"viscous_n_s_m": values["viscous_n_s_m"]}
    axis["coulomb_friction"] = {"coulomb_n": values["coulomb_n"]}
    _write(nominal, axis, controller)
    # named in newtons, but in volts (see the publisher's simulation), and within `vir` already
    injected_n = [
        table["pulses_N"].values * force_per_volt if "pulses_N" in table else np.zeros(len(table["t"].values))
        for table in tables
    ]
    return _Inputs(recordings, injected_n, nominal, values)


def fitted_rigid(recording: AxisRecording) -> dict[str, float]:
    """M a + Fv v + Fc sign(v) = F by least squares behind the state-variable filter, over all of it."""
    low_pass = StateFilter(recording.period_s, FILTER_HZ)
    motion = kinematics(recording.motor_m, recording.period_s)
    columns = (
        low_pass(recording.motor_m, 2),
        low_pass(recording.motor_m, 1),
        low_pass(np.sign(motion.velocity_m_s) * (np.abs(motion.velocity_m_s) > motion.creep_m_s)),
    )
    rows = slice(low_pass.settled, None)
    force_n = low_pass(recording.force_n)
    theta = np.linalg.lstsq(np.stack(columns, axis=1)[rows], force_n[rows], rcond=None)[0]
    return dict(zip(("mass_kg", "viscous_n_s_m", "coulomb_n"), theta.tolist(), strict=True))


def _write(file: Path, axis: dict[str, Any], controller: dict[str, Any]) -> None:
    controller_of(file, AXIS, controller)
    text = tomli_w.dumps({"axis": {AXIS: {**axis, "controller": controller}}})
    write_whole(file, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def _replays(inputs: _Inputs, repaired: Path, force: Explanation) -> dict[str, dict[str, Replay]]:
    """By record and model. The nominal model has no timing; the repaired one has what was found."""
    controller = load_controllers(inputs.nominal)[AXIS]
    plants = {"nominal": plant_of(load_model(inputs.nominal)), "repaired": plant_of(load_model(repaired))}
    delays_s = {"nominal": 0.0, "repaired": remaining_delay_s(force.timing_s, controller.period_s)}
    replays: dict[str, dict[str, Replay]] = {}
    for name, recording, injected_n in zip(
        ("train", "pulses"), inputs.recordings, inputs.injected_n, strict=True
    ):
        for model, plant in plants.items():
            at = (recording, plant, controller)
            delay_s = delays_s[model]
            origin_m = 0.0  # of the record that the model was fitted on
            if name != "train":
                origin_m = fitted_origin_m(*at, injected_n=injected_n, delay_s=delay_s)
            one = replay(*at, injected_n=injected_n, delay_s=delay_s, origin_m=origin_m)
            replays.setdefault(name, {})[model] = one
    return replays
