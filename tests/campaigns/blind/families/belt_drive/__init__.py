"""A carriage on a toothed belt: two masses, Dahl's friction, an embedded Runge-Kutta pair, PID with a notch.

Sources: Dahl, A solid friction model, Aerospace Corporation (1968), and Solid friction damping of
mechanical vibrations, AIAA Journal 14 (1976); Hace, Jezernik and Sabanovic, Improved design of VSS
controller for a linear belt-driven servomechanism, IEEE/ASME Trans. Mechatronics 10 (2005); Bogacki and
Shampine, A 3(2) pair of Runge-Kutta formulas, Applied Mathematics Letters 2 (1989); Kasdin, Discrete
simulation of colored noise, Proceedings of the IEEE 83 (1995).
"""

from tests.campaigns.blind.families.belt_drive.case import draw

__all__ = ["draw"]
