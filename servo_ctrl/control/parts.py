"""The parts of the control law that have a section in the machine file, derived from `AxisParams`."""

import sys

from kernels.record_layout import kinds_of
from servo_ctrl.control.section import LawSection
from servo_ctrl.control.tick import AxisParams


def _sections() -> dict[str, LawSection]:
    sections = {}
    for field, kind in kinds_of(AxisParams).items():
        section = getattr(sys.modules[kind.__module__], "SECTION", None)
        if section is not None:
            sections[field] = section
    return sections


SECTIONS = _sections()
"""Field of `AxisParams` -> section."""
