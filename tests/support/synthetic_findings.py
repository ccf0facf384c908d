"""Synthetic findings with known values, as input of the model update."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from hil_sim.config import AxisPlant, build_plant, load_plant
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.identification.findings import IdentifiedEffect
from reconcile.identification.parameter_estimates import Estimate
from reconcile.model_update.axis_sections import axis_sections
from reconcile.nominal_model.model_file import load_model, write_model
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.regression_data import regression_data

FORCE, POSITION_DEVIATION = ResidualChannel.FORCE, ResidualChannel.POSITION_DEVIATION
FORCE_CONSTANT_N_A = 0.4 * 2.0 * math.pi / 5e-3
PERIOD_S, SAMPLES = 1e-3, 8000
CENTRE_M = 0.013
BASE = {"mass_kg": 50.0, "viscous_n_s_m": 100.0, "coulomb_n": 12.0}
START_K = 295.0


class SyntheticResidual(NamedTuple):
    """The fields of a residual that the model update reads."""

    source: str
    data: RegressionData


class SyntheticExplanation(NamedTuple):
    """The fields of an explanation that the model update reads."""

    channel: ResidualChannel
    findings: list[IdentifiedEffect]
    base: dict[str, float]
    nominal_is_worse: bool
    residuals: list[SyntheticResidual]
    minor: tuple[IdentifiedEffect, ...] = ()


def data(folder: Path, *, warm: bool = False) -> RegressionData:
    """Return data of an axis that oscillates asymmetrically about a centre; y moves far and z a little."""
    t = np.arange(SAMPLES) * PERIOD_S
    x = CENTRE_M + 0.02 * np.sin(2.0 * math.pi * 0.31 * t) + 0.008 * np.sin(2.0 * math.pi * 1.13 * t + 1.0)
    speed = np.abs(np.gradient(x, PERIOD_S))
    decay = math.exp(-PERIOD_S / 10.0)  # C = 2 J/K, R C = 10 s
    friction_w = speed * (BASE["coulomb_n"] + BASE["viscous_n_s_m"] * speed)
    temperature_rise_k = lfilter([PERIOD_S / 2.0], [1.0, -decay], friction_w)
    recording = AxisRecording(
        source="made up",
        axis="x",
        period_s=PERIOD_S,
        time_s=t,
        motor_m=np.round(x / 5e-9) * 5e-9,
        force_n=100.0 * np.gradient(np.gradient(x, PERIOD_S), PERIOD_S),
        scale_m=x,
        reference_m=None,
        temperature_k=START_K + temperature_rise_k if warm else None,
        others={"y": 0.05 * np.cos(t), "z": 0.001 * np.sin(t)},
    )
    return regression_data(recording, load_model(model_file(folder)).axes["x"])


def finding(effect: str, channel: ResidualChannel, terms: Sequence[dict[str, float]]) -> IdentifiedEffect:
    """Return a finding as `reconcile.identification.explain` makes it of terms with these parameters."""
    ends = [f"_{k}" for k in range(1, len(terms) + 1)] if len(terms) > 1 else [""]
    parameters = {
        key + end: Estimate(value, value, value, "")
        for term, end in zip(terms, ends, strict=True)
        for key, value in term.items()
    }
    candidates = [CandidateTerm(effect, (float(k),), False, (k,)) for k in range(len(terms))]
    return IdentifiedEffect(
        effect=effect,
        channel=channel.value,
        confidence=1.0,
        equivalent=[],
        rivals=[],
        candidates=candidates,
        parameters=parameters,
        gain=0.5,
        heldout_gain=0.5,
        explanation="",
    )


def explanations(
    channel: ResidualChannel, findings: list[IdentifiedEffect], seen: RegressionData
) -> list[SyntheticExplanation]:
    """Return explanations of both channels of one recording; one of them has the findings."""
    bases = {
        ResidualChannel.FORCE: BASE,
        ResidualChannel.POSITION_DEVIATION: {"origin_m": 0.0, "delay_s": 0.0},
    }
    residuals = [SyntheticResidual("made up", seen)]
    return [
        SyntheticExplanation(
            channel=one,
            findings=findings if one is channel else [],
            base=dict(base),
            nominal_is_worse=False,
            residuals=residuals,
        )
        for one, base in bases.items()
    ]


def model_file(folder: Path, extra: str = "", inertia_kg_cm2: float = 0.1) -> Path:
    """Write a nominal model of three axes without friction; return the file."""
    axis = f"""
[axis.NAME.transmission]
lead_mm = 5.0
[axis.NAME.motor]
torque_constant_nm_a = 0.4
inertia_kg_cm2 = {inertia_kg_cm2}
[axis.NAME.table]
mass_kg = 30.0
[axis.NAME.encoder]
counts_per_rev = 1000000
[axis.NAME.scale]
resolution_um = 0.1
"""
    file = folder / "nominal.toml"
    file.write_text("".join(axis.replace("NAME", name) for name in "xyz") + extra, encoding="utf-8")
    return file


def updated_axis(
    folder: Path,
    effect: str,
    channel: ResidualChannel,
    terms: list[dict[str, float]],
    seen: RegressionData,
    **nominal: Any,
) -> tuple[AxisPlant, list[str]]:
    """Return the axis updated by one finding, as `hil-sim run` reads it, and the notes."""
    model = load_model(model_file(folder, **nominal))
    made = axis_sections(explanations(channel, [finding(effect, channel, terms)], seen), model, "x")
    file = folder / "model.toml"
    write_model(model, {"x": made.sections}, file)
    config = load_plant(file)
    build_plant(config)
    return config.axes["x"], made.notes


def friction_w(seen: RegressionData) -> Any:
    """Return the friction power (n,) that heats the axis."""
    speed = np.abs(seen.motion.velocity_m_s)
    return speed * (BASE["coulomb_n"] + BASE["viscous_n_s_m"] * speed)
