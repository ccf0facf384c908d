"""A slide on an ironless or iron-core linear motor: Karnopp's friction, stick and slip as events, 2 kHz.

Sources: Karnopp, Computer simulation of stick-slip friction, ASME J. Dynamic Systems 107 (1985); Armstrong-
Helouvry, Dupont and Canudas de Wit, A survey of models for the control of machines with friction,
Automatica 30 (1994); Otten, de Vries, van Amerongen, Rankers and Gaal, Linear motor motion control,
IEEE/ASME Trans. Mechatronics 2 (1997); Heydemann, Determination and correction of quadrature fringe errors,
Applied Optics 20 (1981); Lambrechts, Boerlage and Steinbuch, Trajectory planning and feedforward design,
Control Engineering Practice 13 (2005).
"""

from tests.campaigns.blind.families.linear_motor.case import draw

__all__ = ["draw"]
