"""Pictures of the fuzzy-PD study: the surface, and figures 6 to 8 of Xia et al."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from servo_ctrl.plots.figures import COLOURS, save
from servo_ctrl.plots.matplotlib_agg import Axes, Figure
from studies.xia_fuzzy_pd.study import Trace

COMMAND, TABLE, MOTOR, FRICTION = "0.45", COLOURS[0], COLOURS[4], COLOURS[1]
SINE_PANELS = ("position (mm)", "velocity (mm/s)", "motor force (N)", "error (um)", "position (mm)")
VALUES = ("NB", "NM", "NS", "ZO", "PS", "PM", "PB")


def plot_surface(path: Path, surface: Array) -> None:
    """Draw the output (n, n) over the scaled error (rows) and its scaled change."""
    figure = Figure(figsize=(11.0, 4.8))
    left: Any = figure.add_subplot(1, 2, 1, projection="3d")  # mpl_toolkits has no types
    nodes = np.linspace(-1.0, 1.0, len(surface))
    error, change = np.meshgrid(nodes, nodes, indexing="ij")
    left.plot_surface(error, change, surface, cmap="viridis", rstride=3, cstride=3, linewidth=0.0)
    left.set(xlabel="Ke e", ylabel="Kec de/dt", zlabel="output")
    left.set(**{ticks: [-1.0, -0.5, 0.0, 0.5, 1.0] for ticks in ("xticks", "yticks", "zticks")})
    left.view_init(elev=28.0, azim=-125.0)
    right = figure.add_subplot(1, 2, 2)
    levels = np.linspace(-25.0, 25.0, 26) / 24.0  # between the levels of the plateaus, not on them
    filled = right.contourf(nodes, nodes, surface, levels=levels, cmap="viridis")
    figure.colorbar(filled, ax=right, label="output", ticks=np.linspace(-1.0, 1.0, 7).round(2).tolist())
    centres = np.linspace(-1.0, 1.0, len(VALUES))
    right.set_xticks(centres, VALUES)
    right.set_yticks(centres, VALUES)
    right.set(xlabel="change of the error, Kec de/dt", ylabel="error, Ke e")
    right.grid(color="1.0", alpha=0.35)
    save(figure, path)


def plot_velocity_step(
    path: Path, time_s: Array, forces_n: Mapping[str, Array], velocities_m_s: Mapping[str, Array]
) -> None:
    """Draw figure 6: forces on the table, and velocities, after a step of the velocity command."""
    figure = Figure(figsize=(8.0, 6.4))
    above, below = figure.subplots(2, 1, sharex=True)
    for panel, curves, factor, unit in (
        (above, forces_n, 1.0, "force on the table (N)"),
        (below, velocities_m_s, 1e3, "velocity (mm/s)"),
    ):
        for colour, (label, values) in zip((TABLE, FRICTION, COMMAND, MOTOR), curves.items(), strict=False):
            panel.plot(time_s * 1e3, values * factor, color=colour, linewidth=1.2, label=label)
        panel.set_ylabel(unit)
        panel.legend(fontsize=8)
        panel.grid(alpha=0.3)
    above.set_title("velocity step")
    below.set_xlabel("time since the step (ms)")
    save(figure, path)


def plot_steps(path: Path, traces: Mapping[str, Trace], until_s: float) -> None:
    """Draw figure 7: position, velocity and motor force after a step of the position, a colour a law."""
    figure = Figure(figsize=(8.0, 8.4))
    panels = figure.subplots(3, 1, sharex=True)
    for colour, (law, trace) in zip((FRICTION, TABLE), traces.items(), strict=True):
        shown = trace.time_s <= until_s
        time_ms = trace.time_s[shown] * 1e3
        for panel, values, factor in zip(
            panels, (trace.scale_m, trace.table_m_s, trace.force_n), (1e3, 1e3, 1e-3), strict=True
        ):
            panel.plot(time_ms, values[shown] * factor, color=colour, linewidth=1.2, label=law)
    first = next(iter(traces.values()))
    shown = first.time_s <= until_s
    panels[0].plot(first.time_s[shown] * 1e3, first.command_m[shown] * 1e3, color=COMMAND, ls="--", lw=1.0)
    for panel, label in zip(
        panels, ("position by the scale (mm)", "table velocity (mm/s)", "motor force (kN)"), strict=True
    ):
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[0].legend(fontsize=8)
    panels[0].set_title("position step")
    panels[-1].set_xlabel("time since the step (ms)")
    save(figure, path)


def plot_sines(path: Path, traces: Mapping[str, Trace], reversal_s: float, about_s: float) -> None:
    """Draw figure 8: a column a law; position, velocity, motor force, error, and a reversal enlarged."""
    figure = Figure(figsize=(6.0 * len(traces), 13.0))
    panels = figure.subplots(5, len(traces), sharey="row")
    for column, (law, trace) in zip(panels.T, traces.items(), strict=True):
        _draw_sine(column, trace, reversal_s, about_s)
        column[0].set_title(law)
    save(figure, path)


def _draw_sine(column: NDArray[np.object_], trace: Trace, reversal_s: float, about_s: float) -> None:
    panels: list[Axes] = column.tolist()
    near = np.abs(trace.time_s - reversal_s) < about_s
    time_s, near_ms = trace.time_s, (trace.time_s[near] - reversal_s) * 1e3
    command_m_s = np.gradient(trace.command_m, float(trace.time_s[1] - trace.time_s[0]))
    panels[0].plot(time_s, trace.command_m * 1e3, color=COMMAND, ls="--", lw=1.0, label="command")
    panels[0].plot(time_s, trace.scale_m * 1e3, color=TABLE, lw=1.0, label="scale")
    panels[0].legend(fontsize=8, loc="upper right")
    panels[1].plot(time_s, command_m_s * 1e3, color=COMMAND, ls="--", lw=1.0)
    panels[1].plot(time_s, trace.table_m_s * 1e3, color=TABLE, lw=1.0)
    panels[2].plot(time_s, trace.force_n, color=TABLE, lw=0.6)
    panels[3].plot(time_s, (trace.command_m - trace.scale_m) * 1e6, color=TABLE, lw=1.0)
    panels[4].plot(near_ms, trace.command_m[near] * 1e3, color=COMMAND, ls="--", lw=1.0)
    panels[4].plot(near_ms, trace.scale_m[near] * 1e3, color=TABLE, lw=1.0)
    velocity = panels[4].twinx()
    velocity.plot(near_ms, trace.table_m_s[near] * 1e3, color=FRICTION, lw=1.0)
    velocity.set_ylabel("table velocity (mm/s)", color=FRICTION)
    panels[4].set_xlabel("time since a reversal of the command (ms)")
    panels[3].set_xlabel("time (s)")
    for panel, label in zip(panels, SINE_PANELS, strict=True):
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
