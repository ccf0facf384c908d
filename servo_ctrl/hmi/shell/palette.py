"""Colours of the pages: those of Okabe and Ito, which the colour-blind can tell apart, on light and on dark.

No state is shown by its colour alone: a word or a sign stands beside it.
"""

from typing import NamedTuple

BLACK = "#000000"
ORANGE = "#E69F00"
SKY_BLUE = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILION = "#D55E00"
PURPLE = "#CC79A7"
GREY_LIGHT, GREY_DARK = "#666666", "#9AA4AD"

CURVES_LIGHT = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, GREY_LIGHT, BLACK)
CURVES_DARK = (SKY_BLUE, ORANGE, GREEN, PURPLE, VERMILION, YELLOW, GREY_DARK, "#FFFFFF")
"""Colours of curves in the order of their use: distinct from each other and from the background."""


class Theme(NamedTuple):
    """Colours of a plot on one background; equal to those of static/bench.css around it."""

    background: str
    ink: str
    grid: str
    curves: tuple[str, ...]
    grey: str
    """For what belongs to no curve."""

    def curve(self, number: int) -> str:
        """The colour of a curve by its number, from 0; they repeat after eight."""
        return self.curves[number % len(self.curves)]


LIGHT = Theme(background="#FFFFFF", ink="#1B1F23", grid="#D5DADF", curves=CURVES_LIGHT, grey=GREY_LIGHT)
DARK = Theme(background="#171B1F", ink="#E4E8EB", grid="#38414A", curves=CURVES_DARK, grey=GREY_DARK)


def theme_of(*, dark: bool) -> Theme:
    """The colours on this background."""
    return DARK if dark else LIGHT
