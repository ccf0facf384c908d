"""Pictures of what was learned and is in use: pulses over the acceleration, screws over the travel."""

from collections.abc import Sequence
from pathlib import Path

from servo_ctrl.cli.learned_report import STORES
from servo_ctrl.cli.options import LearnedKind
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.store import StoreError, default_directory
from servo_ctrl.plots.learned import LearnedAxis, plot_learned, plot_screws


def plot_in_use(
    machine: Path, directory: Path | None, axes: Sequence[str] | None, out: Path, kind: LearnedKind
) -> None:
    """Draw the versions in use of the axes (None: all axes). Raises StoreError where there are none."""
    config = load_machine(machine)
    directory = directory or default_directory(config)
    store = STORES[kind](directory, config)
    in_use = [(axis, found) for axis in axes or config.axes if (found := store.active(axis)) is not None]
    if not in_use:
        raise StoreError(f"{directory}: no version is in use, there is nothing to draw")
    if kind is LearnedKind.SCREW:
        screws = {f"{axis}, version {found.version}": found.learned for axis, found in in_use}
        plot_screws(out, screws, f"{config.machine.name}: learned screws")
        return
    pulses = [
        LearnedAxis(
            f"{axis}, version {found.version} ({found.learned.learner})",
            found.learned,
            axis_params(config, axis).pulse.amplitude_max_m_s,
        )
        for axis, found in in_use
    ]
    plot_learned(out, pulses, f"{config.machine.name}: learned friction compensation")
