"""Errors of nodes, each as one line, and the abort codes of our own SDO server."""

from collections.abc import Sequence
from enum import IntEnum

from servo_ctrl.errors import ServoCtrlError


class EdsError(ServoCtrlError):
    """An EDS file that cannot be read, or lacks what the machine file requires."""


class SdoError(ServoCtrlError):
    """A node refused an SDO request (`abort_code` is set) or did not answer it (`abort_code` is None)."""

    def __init__(self, message: str, abort_code: int | None = None) -> None:
        self.abort_code = abort_code
        super().__init__(message)


class NodeError(ServoCtrlError):
    """One node that cannot be used; `problem` says what is wrong and what to do about it."""

    def __init__(self, node: str, problem: str) -> None:
        self.node = node
        self.problem = problem
        super().__init__(f"{node}: {problem}")


class BootError(ServoCtrlError):
    """All nodes that failed to boot, in one message, so that all can be corrected at once."""

    def __init__(self, failures: Sequence[NodeError]) -> None:
        self.failures = tuple(failures)
        nodes_with: dict[str, list[str]] = {}
        for failure in self.failures:
            nodes_with.setdefault(failure.problem, []).append(failure.node)
        head = f"{len(self.failures)} nodes cannot be used: " if len(self.failures) > 1 else ""
        super().__init__(head + "; ".join(f"{', '.join(n)}: {problem}" for problem, n in nodes_with.items()))


class AbortCode(IntEnum):
    """SDO abort codes of CiA 301 (table 22) that our server uses."""

    TOGGLE_NOT_ALTERNATED = 0x0503_0000
    TIMED_OUT = 0x0504_0000
    INVALID_COMMAND = 0x0504_0001
    INVALID_BLOCK_SIZE = 0x0504_0002
    INVALID_SEQUENCE_NUMBER = 0x0504_0003
    CRC_ERROR = 0x0504_0004
    READ_OF_WRITE_ONLY = 0x0601_0001
    WRITE_OF_READ_ONLY = 0x0601_0002
    NO_SUCH_OBJECT = 0x0602_0000
    CANNOT_BE_MAPPED = 0x0604_0041
    PDO_LENGTH_EXCEEDED = 0x0604_0042
    TOO_LONG = 0x0607_0012
    TOO_SHORT = 0x0607_0013
    NO_SUCH_SUBINDEX = 0x0609_0011
    INVALID_VALUE = 0x0609_0030
    VALUE_TOO_HIGH = 0x0609_0031
    VALUE_TOO_LOW = 0x0609_0032
    CANNOT_STORE = 0x0800_0020
    WRONG_DEVICE_STATE = 0x0800_0022
    NO_DATA = 0x0800_0024
    """An empty string or table: SDO cannot upload zero bytes."""


class SdoAbort(Exception):  # noqa: N818  # the term of CiA 301: a response to the client, not an error of the controller
    """Ends the transfer in progress with `code`."""

    def __init__(self, code: AbortCode) -> None:
        self.code = code
        super().__init__(f"{code:08X}h {code.name}")
