"""Mutations of tables: Cosmic Ray's own operators change arithmetic and logic, and here states are data.

Each is an operator in Cosmic Ray's sense, on the syntax tree of parso.
"""

from collections.abc import Iterator, Sequence
from typing import Any

from cosmic_ray.operators.operator import Example, Operator
from parso.python.tree import Name

Position = tuple[tuple[int, int], tuple[int, int]]
DISPLAYS = {"dictorsetmaker", "testlist_comp"}


class ReplaceEnumMember(Operator):
    """`Enum.MEMBER` becomes its neighbours in the enum, the next and the one before; `members` by enum."""

    def __init__(self, members: dict[str, Sequence[str]]) -> None:
        self._members = members

    def mutation_positions(self, node: Any) -> Iterator[Position]:
        """Once for each neighbour."""
        if found := self._member(node):
            for _ in range(min(len(self._members[found[0]]) - 1, 2)):
                yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """The member after this one, or the one before it."""
        found = self._member(node)
        if found is None:
            return node
        enum, member = found
        names = self._members[enum]
        other = names[(names.index(member) + (1, -1)[index]) % len(names)]
        last = node.children[1].children[1]
        node.children[1].children[1] = Name(other, last.start_pos, prefix=last.prefix)
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """For the tests of operators."""
        members = {"members": {"A": ["ONE", "TWO", "SIX"]}}
        return (
            Example("x = A.ONE", "x = A.TWO", 0, members),
            Example("x = A.ONE", "x = A.SIX", 1, members),
            Example("x = {A.TWO: 1}", "x = {A.SIX: 1}", 0, members),
        )

    def _member(self, node: Any) -> tuple[str, str] | None:
        if node.type not in {"power", "atom_expr"} or len(node.children) != 2:
            return None
        first, trailer = node.children
        if first.type != "name" or trailer.type != "trailer" or len(trailer.children) != 2:
            return None
        enum, member = first.value, trailer.children[1].value
        return (enum, member) if member in self._members.get(enum, ()) else None


class ReplaceName(Operator):
    """A name of a group of constants, where it is read, becomes each other of its group in turn."""

    def __init__(self, groups: Sequence[Sequence[str]]) -> None:
        self._group_of = {name: group for group in groups for name in group}

    def mutation_positions(self, node: Any) -> Iterator[Position]:
        """Once for each other name."""
        if self._is_read(node):
            for _ in range(len(self._group_of[node.value]) - 1):
                yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """The name after this one, the one after that, and so on round."""
        group = self._group_of[node.value]
        other = group[(group.index(node.value) + 1 + index) % len(group)]
        return Name(other, node.start_pos, prefix=node.prefix)

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """For the tests of operators."""
        groups = {"groups": [["LOW", "HIGH"]]}
        return (Example("x = {1: LOW}", "x = {1: HIGH}", 0, groups), Example("LOW = 1", "LOW = 1", 0, groups))

    def _is_read(self, node: Any) -> bool:
        return node.type == "name" and node.value in self._group_of and not node.is_definition()


class RemoveEntry(Operator):
    """An entry of a dictionary, set, tuple or list of several goes, with its comma."""

    def mutation_positions(self, node: Any) -> Iterator[Position]:
        """Once for each entry."""
        for start, _ in _entries(node):
            yield node.children[start].start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Without the entry."""
        start, stop = list(_entries(node))[index]
        if start > 0 and stop == len(node.children) and node.children[stop - 1].type != "operator":
            start -= 1  # the last one takes the comma before it along
        del node.children[start:stop]
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """For the tests of operators."""
        return (
            Example("x = {1: 2, 3: 4}", "x = { 3: 4}"),
            Example("x = {1: 2, **y}", "x = {1: 2}", 1),
            Example("x = {1, 2, 3}", "x = {1, 3}", 1),
            Example("x = (1, 2, 3)", "x = (1, 2)", 2),
        )


def _entries(node: Any) -> Iterator[tuple[int, int]]:
    """First child and the one behind the last, of each entry of a display; comprehensions have none."""
    if node.type not in DISPLAYS or any(
        child.type in {"sync_comp_for", "comp_for"} for child in node.children
    ):
        return
    start = 0
    for place, child in enumerate(node.children):
        if child.type == "operator" and child.value == ",":
            yield start, place + 1
            start = place + 1
    if start < len(node.children):
        yield start, len(node.children)
