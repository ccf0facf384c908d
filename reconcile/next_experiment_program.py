"""A motion as a program file that `servo-ctrl run --program` executes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import tomli_w

from servo_ctrl.config.file_format import FORMAT
from servo_ctrl.motion.dwell import Dwell
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.sine import Sine
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from reconcile.next_experiment import Asked

PROGRAM = "next_experiment.toml"
HEAD = """# Written by reconcile: {why}
# servo-ctrl run --machine MACHINE --bus BUS --program {name} --record DIR
# Positions are those of the recordings; what would leave the machine's limits is refused before it moves.

"""


def program_steps(axis: str, steps: Sequence[Move | Sine | Dwell]) -> list[dict[str, Any]]:
    """The steps of docs/programs.md, in its units."""
    return [_step(axis, step) for step in steps]


def write_program(asked: Asked, directory: Path) -> Path | None:
    """`next_experiment.toml` of a verdict's next experiment; None where it is no motion.

    A file of an earlier diagnosis is removed then: it would answer a question that is no longer open.
    """
    file = directory / PROGRAM
    if not asked.program:
        file.unlink(missing_ok=True)
        return None
    head = HEAD.format(why=str(asked.content["why"]).replace("\n", " "), name=PROGRAM)
    text = head + tomli_w.dumps({"format": FORMAT, "step": asked.program})
    write_whole(file, lambda temporary: temporary.write_text(text, encoding="utf-8"))
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
    """To what a nanometre is."""
    return round(value, 6)
