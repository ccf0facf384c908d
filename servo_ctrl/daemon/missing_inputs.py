"""Inputs that do not come: counted in a row for each node, until the node is given up."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from servo_ctrl.daemon.cycle import Inputs


class MissingInputs:
    """How long each node's inputs have been missing; `tolerated` cycles in a row are sailed through."""

    def __init__(self, nodes: int, tolerated: int) -> None:
        self.total = 0
        self.any = False
        """Some node's inputs were missing in the last cycle."""
        self.lost: set[int] = set()
        """Nodes that are given up."""
        self._tolerated = tolerated
        self._in_a_row = [0] * nodes

    def count(self, node: int) -> bool:
        """A node's inputs of this cycle did not come; True once it is given up."""
        self.total += 1
        self._in_a_row[node] += 1
        self.any = True
        given_up = self._in_a_row[node] > self._tolerated
        if given_up:
            self.lost.add(node)
        return given_up

    def recount(self, inputs: Inputs) -> None:
        """Only cycles in a row count."""
        for node, values in enumerate(inputs):
            if values is not None:
                self._in_a_row[node] = 0
        self.any = any(self._in_a_row)
