"""A lift on rack and pinion under gravity: set-valued friction by Moreau's time stepping, P-PI with weight.

Sources: Moreau, Unilateral contact and dry friction in finite freedom dynamics (1988); Acary and Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems (2008); Verl and Engelberth, Adaptive preloading for rack
and pinion drive systems, CIRP Annals 67 (2018); Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky,
Friction models and friction compensation, European Journal of Control 4 (1998).
"""

from tests.campaigns.blind.families.rack_and_pinion.case import draw

__all__ = ["draw"]
