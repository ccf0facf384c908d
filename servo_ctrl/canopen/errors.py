"""What goes wrong between us and the nodes, as one line each."""

from collections.abc import Sequence

from servo_ctrl.errors import ServoCtrlError


class EdsError(ServoCtrlError):
    """An EDS file that cannot be read, or that does not have what the machine file asks of it."""


class SdoError(ServoCtrlError):
    """A node refused an SDO request (`abort_code` is set) or did not answer it (`abort_code` is None)."""

    def __init__(self, message: str, abort_code: int | None = None) -> None:
        self.abort_code = abort_code
        super().__init__(message)


class NodeError(ServoCtrlError):
    """One node that cannot be used: `node` which one, `problem` what is wrong and what to do about it."""

    def __init__(self, node: str, problem: str) -> None:
        self.node = node
        self.problem = problem
        super().__init__(f"{node}: {problem}")


class BootError(ServoCtrlError):
    """All nodes that failed to boot, in one message: whoever walks to the machine walks once."""

    def __init__(self, failures: Sequence[NodeError]) -> None:
        self.failures = tuple(failures)
        nodes_with: dict[str, list[str]] = {}
        for failure in self.failures:
            nodes_with.setdefault(failure.problem, []).append(failure.node)
        head = f"{len(self.failures)} nodes cannot be used: " if len(self.failures) > 1 else ""
        super().__init__(head + "; ".join(f"{', '.join(n)}: {problem}" for problem, n in nodes_with.items()))
