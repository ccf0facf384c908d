"""The report of a tuning: values and margins, Bode plots of plant and loop, and the trials as pictures."""

import math

import numpy as np

from kernels.arrays import Array
from servo_ctrl.files.tuning_files import VELOCITY_LOOP
from servo_ctrl.report.content import LevelLine, Report, ReportPicture, ReportSection, ReportTable, Series
from servo_ctrl.tuning.curves import loop_curves, plant_curves
from servo_ctrl.tuning.machine_file import section_text
from servo_ctrl.tuning.results import AssessedSetting, TuneResult
from servo_ctrl.tuning.summary import summary_lines, trial_rows

FREQUENCY = "frequency, Hz"


def report_of(result: TuneResult) -> Report:
    """Compose the whole report."""
    proved = result.proved
    sentence = (
        f"Ms {result.measured_ms:.2f} was measured with the proposed values, {result.ms:g} was stated; "
        f"{'that is kept' if proved else 'that is above it'}."
    )
    return Report(
        title=f"Tuning of axis {result.axis} of {result.machine}",
        verdict="proved" if proved else "not proved",
        good=proved,
        sentence=sentence,
        sections=(_summary(result), _plant(result), _loops(result), _proof(result)),
    )


def _summary(result: TuneResult) -> ReportSection:
    control = result.sections["control"]
    before = result.before.params
    present = {
        "kp_1_s": before.position_loop.kp_1_s,
        "kv_n_s_m": before.velocity_loop.kv_n_s_m,
        "ki_n_m": before.velocity_loop.ki_n_m,
        "velocity_feedforward": before.feedforward.velocity,
        "acceleration_feedforward_kg": before.feedforward.acceleration_kg,
    }
    rows = [(key, f"{present[key]:g}", f"{value:g}") for key, value in control.items()]
    for key, value in result.sections.get("notch", {}).items():
        rows.append((f"notch.{key}", "", f"{value:g}" if isinstance(value, float) else str(value).lower()))
    margins = [_margin_row("before", result.before), _margin_row("after", result.after)]
    text = section_text(result.axis, result.sections)
    return ReportSection(
        "What was found",
        (
            *summary_lines(result),
            *result.notes,
            "Sections for the machine file: " + " | ".join(text.split("\n")),
        ),
        (
            ReportTable("Values", ("key", "before", "proposed"), tuple(rows)),
            ReportTable(
                "Margins on the measured plant, all paths together at the amplifier's set point",
                (
                    "setting",
                    "stable",
                    "Ms",
                    "at Hz",
                    "phase margin deg",
                    "gain margin dB",
                    "crossover Hz",
                    "um/N",
                ),
                tuple(margins),
                words=2,
                note=f"Ms measured with the proposed values: {result.measured_ms:.3f}",
            ),
        ),
    )


def _margin_row(name: str, setting: AssessedSetting) -> tuple[str, ...]:
    margins = setting.margins
    return (
        name,
        "yes" if margins.stable else "no",
        f"{margins.sensitivity_peak:.2f}",
        f"{margins.peak_hz:.3g}",
        f"{margins.phase_margin_deg:.1f}",
        "-" if math.isinf(margins.gain_margin_db) else f"{margins.gain_margin_db:.1f}",
        f"{margins.crossover_hz:.3g}",
        f"{setting.compliance_m_n * 1e6:.3g}",
    )


def _plant(result: TuneResult) -> ReportSection:
    response, curves = result.response, plant_curves(result)
    series = [Series(one.name, one.frequency_hz, one.magnitude * 1e6) for one in curves]
    angles = [Series(one.name, one.frequency_hz, one.phase_deg) for one in curves]
    hz = response.frequency_hz
    coherence = (Series("motor", hz, response.motor_coherence), Series("scale", hz, response.scale_coherence))
    marks = ", ".join(f"{mode.frequency_hz:.1f} Hz" for mode in result.proposal.resonances) or "none"
    return ReportSection(
        "The plant, from force to position",
        (
            (
                f"{response.averages} periods at {result.plan.speed_m_s * 1e3:.3g} mm/s with a force of "
                f"{result.plan.amplitude_n:.3g} N at most. Resonances: {marks}."
            ),
        ),
        (
            _bode("plant-size", "Magnitude", "um per N", series),
            _phase("plant-phase", "Phase", angles),
            ReportPicture(
                "coherence",
                "Coherence",
                FREQUENCY,
                "",
                coherence,
                note="1: only the excitation moves the axis. Less: noise, friction or backlash take part.",
                kind="semilogarithmic",
            ),
        ),
    )


def _loops(result: TuneResult) -> ReportSection:
    shown = loop_curves(result)
    sensitivity = [
        (one.name, one.frequency_hz, 1.0 / np.abs(1.0 + one.response))
        for one in shown
        if one.name != VELOCITY_LOOP
    ]
    return ReportSection(
        "The loop",
        (
            (
                "L at the set point of the amplifier: position and velocity loop, notch and delays together. "
                "Where |L| crosses 1, its phase above -180 degrees is the phase margin; the peak of "
                "|1 / (1 + L)| is Ms."
            ),
        ),
        (
            _bode(
                "loop-size",
                "|L|",
                "",
                [Series(one.name, one.frequency_hz, one.magnitude) for one in shown],
                unity=True,
            ),
            _phase(
                "loop-phase",
                "Phase of L",
                [Series(one.name, one.frequency_hz, one.phase_deg) for one in shown],
            ),
            ReportPicture(
                "sensitivity",
                "Sensitivity |1 / (1 + L)|",
                FREQUENCY,
                "",
                tuple(Series(name, hz, np.minimum(size, 5.0)) for name, hz, size in sensitivity),
                levels=(LevelLine(f"stated Ms {result.ms:g}", result.ms),),
                note="Cut off at 5.",
                kind="semilogarithmic",
            ),
        ),
    )


def _proof(result: TuneResult) -> ReportSection:
    pictures = []
    for field, heading in (
        ("step", "Step of force"),
        ("move", "Move, and the rest after it"),
        ("circle", "Circle: error along the radius"),
    ):
        series = [
            Series(name, *_in_um(getattr(setting.traces, field)))
            for name, setting in (("before", result.before), ("after", result.after))
            if setting.traces is not None
        ]
        pictures.append(ReportPicture(f"proof-{field}", heading, "time, s", "deviation, um", tuple(series)))
    text = (result.before.remark,) if result.before.remark else ()
    table = ReportTable("Indicators", ("indicator", "before", "after"), tuple(trial_rows(result)))
    return ReportSection("The proof, on the machine", text, (table, *pictures))


def _in_um(trace: tuple[Array, Array]) -> tuple[Array, Array]:
    return trace[0], trace[1] * 1e6


def _bode(name: str, heading: str, label: str, series: list[Series], *, unity: bool = False) -> ReportPicture:
    levels = (LevelLine("1", 1.0),) if unity else ()
    return ReportPicture(name, heading, FREQUENCY, label, tuple(series), levels=levels, kind="logarithmic")


def _phase(name: str, heading: str, series: list[Series]) -> ReportPicture:
    return ReportPicture(
        name,
        heading,
        FREQUENCY,
        "degrees",
        tuple(series),
        levels=(LevelLine("-180", -180.0),),
        kind="semilogarithmic",
    )
