"""A motion as a program file that `servo-ctrl run --program` executes."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from reconcile.formats.toml_file import toml_text
from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.sine import Sine

PROGRAM_FILE = "next_experiment.toml"
HEAD = """# Written by reconcile: {why}
# servo-ctrl run --machine MACHINE --bus BUS --program {name} --record DIR
# Positions are those of the recordings; what would leave the machine's limits is refused before it moves.

"""


def program_steps(axis: str, steps: Sequence[Move | Sine | Dwell]) -> list[dict[str, Any]]:
    """Return the steps in the format and units of docs/programs.md."""
    return [_step(axis, step) for step in steps]


def write_program(steps: Sequence[dict[str, Any]], why: str, directory: Path) -> Path | None:
    """Write `next_experiment.toml` with these steps, and the reason in its head.

    Without steps return None, and remove the file of an earlier diagnosis: its question is closed.
    """
    file = directory / PROGRAM_FILE
    if not steps:
        file.unlink(missing_ok=True)
        return None
    head = HEAD.format(why=why.replace("\n", " "), name=PROGRAM_FILE)
    text = head + toml_text({"format": FORMAT, "step": steps})
    write_text_whole(file, text)
    return file


def _step(axis: str, step: Move | Sine | Dwell) -> dict[str, Any]:
    match step:
        case Move():
            return {
                "kind": "move",
                "label": step.label,
                "to_mm": {axis: _rounded(step.to_m[0] * 1e3)},
                "feed_mm_min": _rounded(step.feed_m_s * 6e4),
                "acceleration_mm_s2": _rounded(step.acceleration_m_s2 * 1e3),
            }
        case Sine():
            return {
                "kind": "sine",
                "label": step.label,
                "axis": axis,
                "amplitude_mm": _rounded(step.amplitude_m * 1e3),
                "frequency_hz": _rounded(step.speed_rad_s / (2.0 * math.pi)),
                "cycles": step.cycles,
                "ramp_s": step.ramp_s,
            }
        case Dwell():
            return {"kind": "dwell", "label": step.label, "seconds": step.duration_s}


def _rounded(value: float) -> float:
    """Round to a nanometre in millimetres."""
    return round(value, 6)
