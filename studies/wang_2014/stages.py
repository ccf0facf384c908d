"""The stages of the positioning study: those of Wang et al. 2014, and the alternatives to them."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:  # the command's help names the stages, and loads no numpy
    from servo_ctrl.motion.input_shaper import ShaperKind

TARGETS = 20
"""Targets over the travel of the precision stage."""


class Stage(NamedTuple):
    """A configuration of the study, with its compensations."""

    name: str
    smooth: bool
    """Five-phase S curves for moves and corrections; else trapezoidal."""
    one_sided: bool = False
    """Approach every target from below, in both directions of the cycle."""
    sampled: bool = False
    """Sampled dual loop."""
    gain: float = 1.0
    """Share of the deviation that a correction takes."""
    corrections: int = 5
    """Most corrections at one end point."""
    screw: bool = False
    """Learned screw table and backlash take-up."""
    shaper: "ShaperKind | None" = None
    """Input shaper for the swing that was measured."""
    continuous: bool = False
    """Position loop on the scale, in the controller (controller_continuous.toml)."""


PAPER = (
    Stage("uncompensated", smooth=False),
    Stage("open_loop", smooth=False, one_sided=True),
    Stage("sampled_dual_loop", smooth=False, sampled=True),
    Stage("smoothed", smooth=True, sampled=True),
)
"""In the order of the paper, each more accurate than the one before."""
OTHERS = (
    Stage("s_curve_alone", smooth=True),
    Stage("screw_table", smooth=True, screw=True),
    Stage("screw_table_sampled", smooth=True, sampled=True, screw=True),
    Stage("continuous_dual_loop", smooth=True, continuous=True),
)
STAGES = {stage.name: stage for stage in (*PAPER, *OTHERS)}
