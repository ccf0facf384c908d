"""Counts consecutive missing inputs of each node until the node is given up."""

from typing import NamedTuple

from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.cycle.missed_ticks import BlockCount


class Tolerance(NamedTuple):
    """How many missing inputs are tolerated: in consecutive cycles, and in a block (`missed_ticks`)."""

    consecutive: int
    per_block: int


class MissingInputs:
    """Counts the cycles in which each node's inputs were missing."""

    def __init__(self, nodes: int, tolerance: Tolerance) -> None:
        self.total = self.cycles = 0
        """Missing inputs of all nodes together, and the cycles in which any were missing."""
        self.any = False
        """Whether any node's inputs were missing in the last cycle."""
        self.lost: set[int] = set()
        """Nodes that were given up."""
        self._cycle = -1
        self._tolerance = tolerance
        self._consecutive = [0] * nodes
        self._in_block = [BlockCount() for _ in range(nodes)]

    def count(self, node: int, cycle: int) -> bool:
        """Count a node's missing inputs in this cycle; return whether the node is given up."""
        self.total += 1
        self.cycles += cycle != self._cycle
        self._cycle = cycle
        self._consecutive[node] += 1
        in_block = self._in_block[node].add(cycle, 1)
        self.any = True
        tolerance = self._tolerance
        given_up = self._consecutive[node] > tolerance.consecutive or in_block > tolerance.per_block
        if given_up:
            self.lost.add(node)
        return given_up

    def recount(self, inputs: Inputs) -> None:
        """Reset the consecutive count of nodes whose inputs arrived."""
        for node, values in enumerate(inputs):
            if values is not None:
                self._consecutive[node] = 0
        self.any = any(self._consecutive)
