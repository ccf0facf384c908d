"""Settings of how a program runs: overrides of its speed, and stops after steps."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from servo_ctrl.motion.move import Move
from servo_ctrl.motion.path.path_move import Element, PathMove
from servo_ctrl.motion.program import Step


@dataclass
class Pace:
    """Overrides as shares, > 0; they may change while a program runs."""

    feed: float = 1.0
    """Above 1 it acts on programs that are planned from then on."""
    rapid: float = 1.0
    """At most 1: a rapid move is as fast as the axes allow."""

    def raised_feed(self) -> float:
        """Return the share of its feed to which a program is planned, >= 1."""
        return max(self.feed, 1.0)

    def set_feed(self, percent: float) -> None:
        """Set the feed override."""
        self.feed = 0.01 * percent

    def set_rapid(self, percent: float) -> None:
        """Set the override of rapid moves."""
        self.rapid = 0.01 * percent


@dataclass
class Stops:
    """Where a program holds without a command."""

    last_step: int = -1
    """Number of the last step, after which the program ends anyway."""
    single_block: bool = False
    """Whether to hold after every step; may change while the program runs."""
    optional: Mapping[int, str] = field(default_factory=dict)
    """The steps followed by M1, and a text that names its line."""

    @property
    def any(self) -> bool:
        """Whether the program may hold anywhere."""
        return self.single_block or bool(self.optional)

    def reason_after(self, step: int) -> str:
        """Return why the program holds after this step, else ""."""
        if step >= self.last_step:
            return ""
        return self.optional.get(step, "") or ("single block" if self.single_block else "")


def at_raised_feed(steps: Sequence[Step], raised: float, velocity_m_s: float) -> Sequence[Step]:
    """Return the steps with the feeds of paths and moves multiplied by `raised` (>= 1).

    Paths are planned within the limits at any feed; a move is kept to `velocity_m_s`, the least velocity
    limit of the axes. Other steps are measurements at the speed that their program states.
    """
    if raised <= 1.0:
        return steps
    result: list[Step] = []
    for step in steps:
        match step:
            case PathMove():
                elements = (element._replace(feed_m_s=element.feed_m_s * raised) for element in step.elements)
                result.append(step._replace(elements=tuple(elements)))
            case Move():
                feed_m_s = max(step.feed_m_s, min(step.feed_m_s * raised, velocity_m_s))
                result.append(step._replace(feed_m_s=feed_m_s))
            case _:
                result.append(step)
    return result


def split_paths(
    steps: Sequence[Step], optional_stops: Collection[int], *, single_block: bool
) -> tuple[list[Step], dict[int, str]]:
    """Split paths where the axes must come to rest: after every block, or at the lines with M1.

    Also return the steps followed by M1, and a text that names its line.
    """
    result: list[Step] = []
    stops: dict[int, str] = {}
    for place, step in enumerate(steps):
        if not isinstance(step, PathMove):
            result.append(step)
            continue
        part: list[Element] = []
        later = (other.elements[0].line for other in steps[place + 1 :] if isinstance(other, PathMove))
        next_line = next(later, math.inf)
        for element, following in zip(step.elements, (*step.elements[1:], None), strict=True):
            part.append(element)
            until = next_line if following is None else following.line
            lines = [line for line in optional_stops if element.line <= line < until]
            if single_block or lines or following is None:
                result.append(_path(step, part))
                part = []
            if lines:
                stops[len(result) - 1] = f"optional stop, line {lines[0]}"
    return result, stops


def _path(step: PathMove, elements: Sequence[Element]) -> PathMove:
    *before, last = elements
    if len(elements) == len(step.elements):
        return step
    lines = f"line {last.line}" if not before else f"lines {before[0].line}-{last.line}"
    return step._replace(label=lines, elements=(*before, last._replace(exact_stop=True)))
