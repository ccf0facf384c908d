"""Runaway sign: the motor force has the opposite sign of what the amplifier assumes.

Law: the force constant changes its sign, and so does the gain of the amplifier's velocity loop, which divides
by it, as if two motor phases, or the encoder's tracks, were exchanged. Every loop closed on the axis, in
controller and drive, has positive feedback; the reported current is the one that the amplifier assumes.
"""

from typing import NamedTuple

from hil_sim.faults.fault_target import FaultTarget


class Params(NamedTuple):
    """The fault has no parameters."""


def begin(target: FaultTarget, _p: Params) -> None:
    """Change the sign of the force constant."""
    target.params["mechanics"]["force_constant_n_a"] *= -1.0
    amplifier = target.params["amplifier"]
    amplifier["velocity_gain_n_s_m"] *= -1.0
    amplifier["velocity_integral_n_m"] *= -1.0
