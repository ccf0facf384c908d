"""The table of the EMPS example: results beside published values."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from reconcile.examples.example import Row
from reconcile.examples.held_out_record import RejectedEffect, Stage
from reconcile.replay.replay import Replay
from reconcile.report.words import display_name, interval, parameter_names

PUBLISHED = {"mass_kg": 95.109, "viscous_n_s_m": 203.50, "coulomb_n": 20.394}
PUBLISHED_FORCE_ERRORS = (0.0585, 0.0894)
"""Relative error of the published closed-loop simulation, by record."""
PROTOTYPE_RESIDUAL_N = 1.59
"""Force residual of an early prototype on the second record: the mark."""


def identified_rows(values: Mapping[str, Any], findings: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Return the rows of the initial model and of the identified effects."""
    nominal = values["nominal"]
    rows = [
        Row("start: mass, fitted", f"{nominal['mass_kg']:.2f} kg", f"{PUBLISHED['mass_kg']} kg"),
        Row(
            "start: viscous, fitted",
            f"{nominal['viscous_n_s_m']:.1f} N s/m",
            f"{PUBLISHED['viscous_n_s_m']} N s/m",
        ),
        Row(
            "start: Coulomb, fitted",
            f"{nominal['coulomb_n']:.2f} N",
            f"{PUBLISHED['coulomb_n']} N, beside an offset",
        ),
    ]
    for finding in findings:
        names = parameter_names(finding["parameters"])
        sizes = ", ".join(f"{names[key]} {interval(p)}" for key, p in finding["parameters"].items())
        rows.append(Row(f"named: {display_name(finding['effect'])}", sizes))
    rows.append(Row("named, both records", ", ".join(display_name(name) for name in values["named"]["both"])))
    if values["timing_s"]:
        timing = f"{values['timing_s'] * 1e3:.2f} ms"
        rows.append(Row("timing, hold within (0.5 ms)", timing, "0.35 ms in a prototype"))
    for ripple in values["ripples"]:
        own = f"{ripple['amplitude_n']:.2f} N, phase {math.degrees(ripple['phase_rad']):.0f} deg"
        rows.append(
            Row(f"once a turn, {ripple['source'].rsplit('/', 1)[-1]} alone", own, "about 1 N, unpublished")
        )
    return rows


def held_out(stages: list[Stage], rejected: RejectedEffect | None) -> list[Row]:
    """Return the rows of the force residuals of both records, and of the rejected effect."""
    rows = [
        Row(
            f"{'+ ' if place else 'residual of first, held-out record: '}{display_name(stage.effect)}",
            f"{stage.train_n:.2f} / {stage.heldout_n:.2f} N",
            f"{PROTOTYPE_RESIDUAL_N} N held out" if place == len(stages) - 1 else "",
        )
        for place, stage in enumerate(stages)
    ]
    if rejected:
        judged = (
            f"t {rejected.t:.1f} of {rejected.needed:.1f} needed; takes {100.0 * rejected.gain:.1f} % of the "
            f"squares, {100.0 * rejected.heldout_gain:.1f} % on the held-out record"
        )
        rows.append(Row(f"rejected: {display_name(rejected.effect)}", judged, "to be rejected"))
    return rows


def closed_loop(replays: dict[str, dict[str, Replay]]) -> list[Row]:
    """Return the rows of the replay errors."""
    rows = []
    for (name, pair), published in zip(replays.items(), PUBLISHED_FORCE_ERRORS, strict=True):
        before, after = pair["nominal"].error(), pair["repaired"].error()
        rows += [
            Row(
                f"replayed force error, {name}",
                f"{100.0 * before.force_relative:.2f} -> {100.0 * after.force_relative:.2f} %",
                f"{100.0 * published:.2f} %",
            ),
            Row(
                f"replayed position error, {name}",
                f"{before.motor_rms_m * 1e6:.2f} -> {after.motor_rms_m * 1e6:.2f} um",
            ),
        ]
    origin_m = replays["pulses"]["repaired"].origin_m
    rows.append(Row("zero of second record in a turn", f"{origin_m * 1e3:.3f} mm"))
    return rows
