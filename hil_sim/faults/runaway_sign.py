"""Runaway sign: the motor pushes the other way than the amplifier assumes.

Law: the force constant changes its sign, and with it the sense of the amplifier's own velocity loop, which
divides by it. Two motor phases exchanged, or an encoder whose tracks are. Every loop closed on the axis,
the controller's and the drive's, has positive feedback; the reported current is what the amplifier assumes.
"""

from typing import NamedTuple

from hil_sim.faults.fault_target import FaultTarget


class Params(NamedTuple):
    """Nothing to choose."""


def begin(target: FaultTarget, _p: Params) -> None:
    """The force constant changes its sign."""
    target.params["mechanics"]["force_constant_n_a"] *= -1.0
    amplifier = target.params["amplifier"]
    amplifier["velocity_gain_n_s_m"] *= -1.0
    amplifier["velocity_integral_n_m"] *= -1.0
