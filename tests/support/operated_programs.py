"""An operated machine with a part program: loading it and lines, and the time and the speed of the motion."""

from pathlib import Path

import numpy as np
from ideal_drives import PERIOD_S, OperatedStand

from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_program

BRACKET = """G21 G90 G64 P0.05
G0 X0 Y0
G1 X4 F1200
Y3
M1
X0
G0 Y0
M2
"""
LIMIT_M_S2 = 2.0


def load(made: OperatedStand, directory: Path, text: str = BRACKET, first_line: int = 1) -> str:
    path = directory / "bracket.ngc"
    path.write_text(text, encoding="utf-8")
    program = load_program(path, made.config, reading=made.handler.reading(first_line))
    reason: str = made.handler.load_program(program).reason
    return reason


def line(made: OperatedStand, directory: Path, text: str) -> str:
    path = directory / "line.ngc"
    path.write_text(text, encoding="utf-8")
    reason: str = made.handler.run_line(
        load_program(path, made.config, reading=made.handler.reading_of_line())
    ).reason
    return reason


def run_out(made: OperatedStand, cycles: int = 20_000) -> int:
    """Run until the machine is ready; how many cycles that took."""
    before = made.cycle
    while made.machine.stage is not Stage.READY or made.cycle == before:
        made.run(1)
        assert made.cycle - before < cycles
    return made.cycle - before


def speed_m_s(commanded_m: np.ndarray) -> np.ndarray:
    return np.hypot(*np.diff(commanded_m, axis=0).T) / PERIOD_S
