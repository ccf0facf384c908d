"""Picture of learned screws: error of the lead and lost motion over the travel."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.plots.figures import COLOURS, save
from servo_ctrl.plots.matplotlib_agg import plt
from servo_ctrl.units import MM, UM


class ScrewAxis(NamedTuple):
    """What is drawn of one axis."""

    label: str
    learned: ScrewLearned


def plot_screws(path: Path, axes: Sequence[ScrewAxis], title: str) -> None:
    """Draw the error as the control law reads it, and the lost motion with its mean. Raises OSError."""
    figure, (errors, lost) = plt.subplots(2, 1, figsize=(9.6, 7.2), sharex=True, layout="constrained")
    for place, axis in enumerate(axes):
        colour = COLOURS[place % len(COLOURS)]
        position_m, error_m, lost_m = np.array(axis.learned.points).T
        errors.plot(position_m / MM, error_m / UM, color=colour, linewidth=1.0, label=axis.label)
        lost.plot(position_m / MM, lost_m / UM, color=colour, linewidth=1.0)
        mean_um = axis.learned.lost_motion_m / UM
        lost.axhline(mean_um, color=colour, linestyle="--", label=f"{axis.label}: mean {mean_um:.2f} um")
    errors.set_ylabel("scale less encoder (µm)")
    lost.set_ylabel("lost motion (µm)")
    lost.set_ylim(bottom=0.0)
    lost.set_xlabel("position of the table (mm)")
    for panel in (errors, lost):
        panel.grid(alpha=0.3)
        panel.legend(fontsize=9)
    figure.suptitle(title)
    save(figure, path, tight=False)
