"""The list of clauses: one function each, whose docstring states the requirement.

The function returns if the node meets the clause, and raises Failed or NotApplicable otherwise. It restores
what it changes in the node, and no clause enables operation: a motor stays without power.
"""

import struct
from collections.abc import Callable
from typing import NamedTuple

from servo_ctrl.canopen.errors import AbortCode
from servo_ctrl.canopen.pdo import STRUCT_FORMATS
from servo_ctrl.canopen.stack import Eds, EdsVariable
from servo_ctrl.conformance.dialogue import Dialogue, NotApplicable

WRONG_LENGTH = (0x0607_0010, AbortCode.TOO_LONG, AbortCode.TOO_SHORT)
OUT_OF_RANGE = (AbortCode.INVALID_VALUE, AbortCode.VALUE_TOO_HIGH, AbortCode.VALUE_TOO_LOW, 0x0604_0043)
CANNOT_BE_MAPPED, PDO_TOO_LONG, NO_BLOCK_TRANSFER = 0x0604_0041, 0x0604_0042, AbortCode.INVALID_COMMAND
OFF, PRE_OPERATIONAL, OPERATIONAL, STOPPED = 0x8000_0000, 0x7F, 0x05, 0x04
START, STOP, ENTER_PRE_OPERATIONAL, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x82
BOOT_UP_LIMIT_S = 5.0
"""Bounds the time for a restart of communication; chosen."""
TPDO, TPDO_MAPPING = 0x1800, 0x1A00


class NodeUnderTest(NamedTuple):
    """The node under test, and its EDS."""

    dialogue: Dialogue
    eds: Eds

    def variable(self, index: int, subindex: int = 0) -> EdsVariable:
        """Return an entry of the EDS. Raises NotApplicable without it."""
        variable = self.eds.variables.get((index, subindex))
        if variable is None:
            raise NotApplicable(f"the EDS has no {index:04X}h:{subindex:02X}")
        return variable

    def without_errors(self) -> None:
        """Raise NotApplicable if 1001h reports an error: the node may then refuse operational (1029h)."""
        if register := self.dialogue.number(0x1001):
            raise NotApplicable(f"it has an error, 1001h is {register:02X}h, and need not become operational")


class Clause(NamedTuple):
    """A requirement of a standard, and the dialogue that tests it."""

    number: str
    title: str
    check: Callable[[NodeUnderTest], None]


CLAUSES: list[Clause] = []


def clause(number: str) -> Callable[[Callable[[NodeUnderTest], None]], Callable[[NodeUnderTest], None]]:
    """Register a dialogue, with its docstring as the title."""

    def add(check: Callable[[NodeUnderTest], None]) -> Callable[[NodeUnderTest], None]:
        CLAUSES.append(Clause(number, (check.__doc__ or "").rstrip("."), check))
        return check

    return add


def size_of(variable: EdsVariable) -> int:
    """Return the size of a number in bytes; 0 for text and domains."""
    pattern = STRUCT_FORMATS.get(variable.data_type)
    return struct.calcsize("<" + pattern) if pattern else 0
