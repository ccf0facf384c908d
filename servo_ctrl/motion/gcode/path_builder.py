"""Builds the motion of a part program block by block: targets, lines, arcs, and paths from rest to rest."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from servo_ctrl.motion.gcode.arc import PLANES, SAME_M, ArcError, centre_by_offset, centre_by_radius
from servo_ctrl.motion.gcode.block import SortedBlock
from servo_ctrl.motion.gcode.blocks import Word
from servo_ctrl.motion.path.path_move import Arc, Element, Line, PathMove
from servo_ctrl.motion.program import Step
from servo_ctrl.units import MM

USUAL_TOLERANCE_M = 10e-6
"""Tolerance of corners, metres, until G64 P changes it; chosen."""
AXIS_LETTERS = frozenset("XYZABCUVW")
_FIRST_MOTION = (
    "the first motion must be a straight one in absolute coordinates that names every axis of the program, "
    "so that the program does the same from wherever it starts"
)


@dataclass(slots=True)
class Modes:
    """The modal state of a part program."""

    motion: str = ""
    plane: str = "G17"
    absolute: bool = True
    unit_m: float = MM
    feed_m_s: float = math.nan
    exact: bool = False
    tolerance_m: float = USUAL_TOLERANCE_M
    work_offset: str = "G54"

    @property
    def words(self) -> str:
        """The words that set this state, such as "G1 G17 G21 G90 G54 G64 P0.01 F600"."""
        return " ".join(
            word
            for word in (
                self.motion,
                self.plane,
                "G21" if self.unit_m == MM else "G20",
                "G90" if self.absolute else "G91",
                self.work_offset,
                "G61" if self.exact else f"G64 P{self.tolerance_m / self.unit_m:.6g}",
                "" if math.isnan(self.feed_m_s) else f"F{self.feed_m_s * 60.0 / self.unit_m:.6g}",
            )
            if word
        )


class PathBuilder:
    """Collects the steps of a part program: paths from rest to rest, and the reader's dwells."""

    def __init__(
        self,
        axes: Sequence[str],
        offsets_m: Mapping[str, Sequence[float]],
        modes: Modes,
        start_m: Sequence[float] | None = None,
    ) -> None:
        """`offsets_m`: zeros of the axes by work offset. `modes`: the modal state, which the reader changes.

        `start_m`: positions where a single line of G-code starts; without it the first motion must name every
        axis of the program. All positions are metres in machine order.
        """
        self.steps: list[Step] = []
        self._axes, self._offsets_m, self._modes = list(axes), offsets_m, modes
        self.position_m = [math.nan] * len(self._axes) if start_m is None else list(start_m)
        """End of the last motion; NaN = the program does not move the axis."""
        self._first_line = 0 if start_m is None else -1
        """Line of the first motion; 0 before it, -1 if `start_m` is given."""
        self._elements: list[Element] = []

    def move(self, block: SortedBlock) -> None:
        """Add the motion of a block, if it has one; unused words stay in the block. Raises ConfigError."""
        modes = self._modes
        axis_words = {letter.lower(): word for letter, word in block.words.items() if letter in AXIS_LETTERS}
        is_arc = modes.motion in {"G2", "G3"}
        if not axis_words and not (is_arc and block.words.keys() & {"I", "J", "K", "R"}):
            return
        if not modes.motion:
            block.fail("which motion? G0, G1, G2 or G3 is missing, here or before")
        if modes.motion != "G0" and math.isnan(modes.feed_m_s):
            block.fail(f"{modes.motion} needs a feed: F is missing, here or before")
        end_m = self._target_m(block, axis_words)
        exact_here = block.codes.pop("exact stop", "") != ""
        exact = modes.exact or exact_here
        if is_arc:
            self._add_arc(block, end_m, exact=exact)
        elif self._first_line == 0:
            self._first_line = block.line
            self._add_element(Line(tuple(end_m)), block.line, exact=True)
            self.end_path("approach, ")
        elif not _same_position(end_m, self.position_m):
            self._add_element(Line(tuple(end_m)), block.line, exact=exact)
        elif exact and self._elements:  # no distance, but an exact stop
            self._elements[-1] = self._elements[-1]._replace(exact_stop=True)
        self.position_m = end_m

    def begin_at(self, line: int) -> None:
        """Replace all motion before this line by a straight approach to its end."""
        self.steps, self._elements = [], []
        if self._first_line:
            self._elements = [Element(Line(tuple(self.position_m)), math.inf, line, True)]
            self.end_path("approach, ")

    def end_path(self, prefix: str = "") -> None:
        """Make the elements so far a step, at whose end the axes rest; `prefix` begins its label."""
        if not self._elements:
            return
        first, last = self._elements[0], self._elements[-1]
        lines = f"line {last.line}" if last.line == first.line else f"lines {first.line}-{last.line}"
        elements = (*self._elements[:-1], last._replace(exact_stop=True))
        self.steps.append(PathMove(prefix + lines, elements, self._modes.tolerance_m))
        self._elements = []

    def plane_axes(self, block: SortedBlock) -> tuple[int, int]:
        """Return the indices of the axes of the active plane."""
        axes = PLANES[self._modes.plane].axes
        for axis in axes:
            if axis not in self._axes:
                block.fail(
                    f"{self._modes.plane} needs {' and '.join(axes)}: {unknown_axis(axis, self._axes)}"
                )
        return self._axes.index(axes[0]), self._axes.index(axes[1])

    def _target_m(self, block: SortedBlock, axis_words: dict[str, Word]) -> list[float]:
        """Return the end of the motion, and take its axis words out of the block."""
        modes = self._modes
        if self._first_line == 0 and not (modes.absolute and modes.motion in {"G0", "G1"}):
            block.fail(_FIRST_MOTION)
        end_m = list(self.position_m)
        for axis, word in axis_words.items():
            if axis not in self._axes:
                block.fail(f"{word.text}: {unknown_axis(axis, self._axes)}")
            index = self._axes.index(axis)
            if self._first_line:
                self._require_position(block, [index])
            origin_m = self._offsets_m[modes.work_offset][index] if modes.absolute else end_m[index]
            end_m[index] = origin_m + word.value * modes.unit_m
            del block.words[word.letter]
        return end_m

    def _require_position(self, block: SortedBlock, axes: Sequence[int]) -> None:
        """Fail if an axis of the motion was not named by the first one."""
        for index in axes:
            if math.isnan(self.position_m[index]):
                axis = self._axes[index]
                block.fail(f"axis {axis} is not named by line {self._first_line}; {_FIRST_MOTION}")

    def _add_arc(self, block: SortedBlock, end_m: list[float], *, exact: bool) -> None:
        """Add G2 or G3 to `end_m`; a full circle ends exactly at its start."""
        first, second = axes = self.plane_axes(block)
        self._require_position(block, axes)
        start = self.position_m[first], self.position_m[second]
        if math.dist(start, (end_m[first], end_m[second])) < SAME_M:
            end_m[first], end_m[second] = start
        try:
            centre_m = self._centre_m(block, start, (end_m[first], end_m[second]))
        except ArcError as error:
            block.fail(f"{self._modes.motion}: {error}")
        arc = Arc(tuple(end_m), centre_m, axes, counterclockwise=self._modes.motion == "G3")
        self._add_element(arc, block.line, exact=exact)

    def _centre_m(
        self, block: SortedBlock, start: tuple[float, float], end: tuple[float, float]
    ) -> tuple[float, float]:
        """Return the centre of an arc, metres in the plane. Raises ArcError."""
        letters, unit_m = PLANES[self._modes.plane].centre, self._modes.unit_m
        radius = block.take("R")
        offsets = [block.take(letter) for letter in letters]
        if (radius is None) == (offsets == [None, None]):
            raise ArcError(f"the centre is given either by R or by {' and '.join(letters)}")
        if radius is not None:
            counterclockwise = self._modes.motion == "G3"
            return centre_by_radius(start, end, radius * unit_m, counterclockwise=counterclockwise)
        return centre_by_offset(start, end, ((offsets[0] or 0.0) * unit_m, (offsets[1] or 0.0) * unit_m))

    def _add_element(self, shape: Line | Arc, line: int, *, exact: bool) -> None:
        feed_m_s = math.inf if self._modes.motion == "G0" else self._modes.feed_m_s
        self._elements.append(Element(shape, feed_m_s, line, exact))


def unknown_axis(axis: str, axes: Sequence[str]) -> str:
    """Return the message about an axis that the machine lacks."""
    return f'the machine has no axis "{axis}", only {", ".join(axes)}'


def _same_position(one_m: list[float], other_m: list[float]) -> bool:
    """Whether two positions are equal; an axis that is not moved is NaN in both."""
    return all(a == b or (math.isnan(a) and math.isnan(b)) for a, b in zip(one_m, other_m, strict=True))
