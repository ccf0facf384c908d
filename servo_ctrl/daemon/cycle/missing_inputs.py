"""Counts missing inputs in a row for each node, until the node is given up."""

from typing import NamedTuple

from servo_ctrl.daemon.cycle.cycle import Inputs
from servo_ctrl.daemon.cycle.missed_ticks import BlockCount


class Tolerance(NamedTuple):
    """How many missing inputs are tolerated: cycles in a row, and in a block (`missed_ticks`)."""

    in_a_row: int
    in_a_block: int


class MissingInputs:
    """Counts for how many cycles each node's inputs have been missing."""

    def __init__(self, nodes: int, tolerance: Tolerance) -> None:
        self.total = 0
        self.any = False
        """Some node's inputs were missing in the last cycle."""
        self.lost: set[int] = set()
        """Nodes that are given up."""
        self._tolerance = tolerance
        self._in_a_row = [0] * nodes
        self._in_block = [BlockCount() for _ in range(nodes)]

    def count(self, node: int, cycle: int) -> bool:
        """Count missing inputs of a node in this cycle; True once it is given up."""
        self.total += 1
        self._in_a_row[node] += 1
        in_block = self._in_block[node].add(cycle, 1)
        self.any = True
        tolerance = self._tolerance
        given_up = self._in_a_row[node] > tolerance.in_a_row or in_block > tolerance.in_a_block
        if given_up:
            self.lost.add(node)
        return given_up

    def recount(self, inputs: Inputs) -> None:
        """Begin anew for nodes whose inputs came: only cycles in a row count."""
        for node, values in enumerate(inputs):
            if values is not None:
                self._in_a_row[node] = 0
        self.any = any(self._in_a_row)
