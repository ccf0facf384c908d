"""Forces on the table during a program, for pictures: from the batch twin, which knows the plant.

Nothing of servo_ctrl does. The twin is started as a program of its own, as the simulator is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from servo_ctrl.config.columns import read_columns
from servo_ctrl.experiment.twin_process import run_twin

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

LIMIT_S = 120.0
"""A few seconds, most of them for compiling."""
COLUMNS = ("time_s", "transmitted_n", "friction_n", "table_velocity_m_s", "scale_position_m")


class TableForces(NamedTuple):
    """What no sensor shows; (n,) at the SYNC period, from the start of the program."""

    time_s: Array
    transmitted_n: Array
    """From the screw to the table."""
    friction_n: Array
    table_velocity_m_s: Array
    scale_position_m: Array


def table_forces(machine: Path, controller: Path, program: Path, out: Path) -> TableForces:
    """Run a program in the twin of the machine's plant. Raises TwinError, ConfigError."""
    out.parent.mkdir(parents=True, exist_ok=True)
    arguments = ["--machine", str(machine), "--out", str(out)]
    arguments += ["--controller", str(controller), "--program", str(program)]
    run_twin("reconcile.table_forces", arguments, LIMIT_S)
    return TableForces(**read_columns(out, COLUMNS))
