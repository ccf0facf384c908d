"""Pictures of what was learned and is in use: pulses over the acceleration, screws over the travel."""

from collections.abc import Sequence
from pathlib import Path

from servo_ctrl.cli.options import LearnedKind
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.learned.store import LearnedStore, ScrewStore, StoreError, default_directory
from servo_ctrl.plots.learned import LearnedAxis, plot_learned
from servo_ctrl.plots.screw import ScrewAxis, plot_screws


def plot_in_use(
    machine: Path, directory: Path | None, axes: Sequence[str] | None, out: Path, kind: LearnedKind
) -> None:
    """Draw the versions in use of the axes (None: all axes). Raises StoreError where there are none."""
    config = load_machine(machine)
    directory, names = directory or default_directory(config), axes or list(config.axes)
    plot = _plot_screws if kind is LearnedKind.SCREW else _plot_pulses
    if not plot(config, directory, names, out):
        raise StoreError(f"{directory}: no version is in use, there is nothing to draw")


def _plot_pulses(config: MachineConfig, directory: Path, axes: Sequence[str], out: Path) -> bool:
    store = LearnedStore(directory, config)
    drawn = [
        LearnedAxis(
            f"{axis}, version {result.version} ({result.learned.learner})",
            result.learned,
            axis_params(config, axis).pulse.amplitude_max_m_s,
        )
        for axis in axes
        if (result := store.active(axis)) is not None
    ]
    if drawn:
        plot_learned(out, drawn, f"{config.machine.name}: learned friction compensation")
    return bool(drawn)


def _plot_screws(config: MachineConfig, directory: Path, axes: Sequence[str], out: Path) -> bool:
    store = ScrewStore(directory, config)
    drawn = [
        ScrewAxis(f"{axis}, version {result.version}", result.learned)
        for axis in axes
        if (result := store.active(axis)) is not None
    ]
    if drawn:
        plot_screws(out, drawn, f"{config.machine.name}: learned screws")
    return bool(drawn)
