"""A table on a ball screw: two masses, generalised Maxwell slip, backward Euler, P-PI with an observer.

Sources: Al-Bender, Lampaert and Swevers, The generalized Maxwell-slip model, IEEE Trans. Automatic Control
50 (2005); Altintas, Verl, Brecher, Uriarte and Pritschow, Machine tool feed drives, CIRP Annals 60 (2011);
Ohnishi, Shibata and Murakami, Motion control for advanced mechatronics, IEEE/ASME Trans. Mechatronics 1
(1996); Simo and Hughes, Computational Inelasticity (1998), for the return mapping.
"""

from tests.campaigns.blind.families.ball_screw.case import draw

__all__ = ["draw"]
