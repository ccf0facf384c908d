"""Figures of the examples as PNG."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from kernels.arrays import Array
from reconcile.examples.held_out_record import Orders, Ripple
from reconcile.regression.residual import Residual
from reconcile.replay.replay import Replay
from servo_ctrl.files.whole_file import write_whole
from servo_ctrl.plots.matplotlib_agg import Axes, Figure

BEFORE, AFTER, MEASURED = "tab:orange", "tab:blue", "0.25"
SPEED_BINS = 40
MOVING_MEAN_S = 0.05
"""Smooths the replay error so that both models can be compared by eye."""


def emps(
    path: Path,
    residual: Residual,
    ripple: tuple[Sequence[Orders], Sequence[Ripple]],
    replays: Mapping[str, Mapping[str, Replay]],
    published: Sequence[float],
) -> Path:
    """Draw the force residual over velocity, the orders of a turn, and the replays."""
    figure = Figure(figsize=(11.0, 7.5), layout="constrained")
    over_speed, over_turn, over_time, errors = figure.subplots(2, 2).flat
    _over_velocity(over_speed, residual)
    _over_turn(over_turn, *ripple)
    _over_time(over_time, replays["pulses"])
    _errors(errors, replays, published)
    return _written(figure, path)


def odrive(path: Path, position_deg: Array, measured_a: Array, model_a: Array, left: str) -> Path:
    """Draw the held-out map beside the model, and the residual."""
    figure = Figure(figsize=(11.0, 5.5), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    upper.plot(
        position_deg, measured_a - measured_a.mean(), color=MEASURED, lw=1.0, label="measured, held out"
    )
    upper.plot(position_deg, model_a - model_a.mean(), color=AFTER, lw=1.0, label="model from the other maps")
    upper.set(ylabel="holding current / A", title=f"ODrive, map that was held out: {left}")
    upper.legend(loc="lower right", ncols=2)
    residual_a = measured_a - model_a
    lower.plot(position_deg, residual_a - residual_a.mean(), color=BEFORE, lw=0.8)
    lower.set(xlabel="motor angle / deg", ylabel="left / A", xlim=(0.0, 360.0), ylim=upper.get_ylim())
    return _written(figure, path)


def _over_velocity(axes: Axes, residual: Residual) -> None:
    velocity_m_s = residual.data.motion.velocity_m_s
    edges = np.linspace(velocity_m_s.min(), velocity_m_s.max(), SPEED_BINS + 1)
    place = np.clip(np.digitize(velocity_m_s, edges) - 1, 0, SPEED_BINS - 1)
    middle = 500.0 * (edges[1:] + edges[:-1])
    for values, colour, label in (
        (residual.refitted, BEFORE, "nominal model, refitted"),
        (residual.after, AFTER, "with the effects"),
    ):
        count = np.bincount(place[residual.used], minlength=SPEED_BINS)
        mean_n = np.bincount(place[residual.used], values[residual.used], SPEED_BINS) / np.maximum(count, 1)
        axes.plot(middle[count > 20], mean_n[count > 20], "o-", ms=3, color=colour, label=label)
    axes.axhline(0.0, color="0.8", lw=0.8)
    axes.set(
        xlabel="velocity / mm/s", ylabel="mean force residual / N", title="first record, over the velocity"
    )
    axes.legend()


def _over_turn(axes: Axes, orders: Sequence[Orders], ripples: Sequence[Ripple]) -> None:
    for one, ripple, colour, record in zip(
        orders, ripples, (AFTER, BEFORE), ("first record", "record with pulses"), strict=True
    ):
        label = f"{record}: {ripple.amplitude_n:.2f} N at {math.degrees(ripple.phase_rad):.0f} deg"
        axes.plot(one.cycles_1_turn, 100.0 * one.share, "o-", ms=3, color=colour, label=label)
    axes.set(
        xlabel="cycles a turn of 2.5 mm",
        ylabel="share of what is left / %",
        title="what repeats over the travel",
    )
    axes.set_ylim(bottom=0.0)
    axes.legend()


def _over_time(axes: Axes, pair: Mapping[str, Replay]) -> None:
    for model, colour in (("nominal", BEFORE), ("repaired", AFTER)):
        one = pair[model]
        width = max(round(MOVING_MEAN_S / (one.time_s[1] - one.time_s[0])), 1)
        apart_n = np.convolve(one.replayed_force_n - one.force_n, np.ones(width) / width, mode="same")
        axes.plot(one.time_s, apart_n, color=colour, lw=0.8, label=f"{model} model")
    axes.set(
        xlabel="time / s",
        ylabel=f"replayed less recorded force, {MOVING_MEAN_S * 1e3:.0f} ms mean / N",
        title="closed-loop replay of the record with pulses",
    )
    axes.legend()


def _errors(axes: Axes, replays: Mapping[str, Mapping[str, Replay]], published: Sequence[float]) -> None:
    place = np.arange(len(replays))
    bars = {
        "published (2019)": (list(published), "0.6"),
        "nominal": ([pair["nominal"].error().force_relative for pair in replays.values()], BEFORE),
        "repaired": ([pair["repaired"].error().force_relative for pair in replays.values()], AFTER),
    }
    for number, (label, (values, colour)) in enumerate(bars.items()):
        drawn = axes.bar(
            place + 0.27 * (number - 1), 100.0 * np.array(values), 0.25, color=colour, label=label
        )
        axes.bar_label(drawn, fmt="%.2f", fontsize=8)
    axes.set_xticks(place, list(replays))
    axes.set(ylabel="closed-loop force error / %", title="error of the replayed force")
    axes.legend(loc="upper left", fontsize=8)
    axes.set_ylim(0.0, 130.0 * max(published))


def _written(figure: Figure, path: Path) -> Path:
    write_whole(path, lambda temporary: figure.savefig(temporary, dpi=100, format="png"))
    return path
