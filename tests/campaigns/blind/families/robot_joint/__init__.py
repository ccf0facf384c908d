"""A robot's joint with a harmonic drive: cubic spring, LuGre, split steps, torque observer; rad and N m.

Sources: Taghirad and Belanger, Modeling and parameter identification of harmonic drive systems, ASME J.
Dynamic Systems 120 (1998); Canudas de Wit, Olsson, Astrom and Lischinsky, A new model for control of
systems with friction, IEEE Trans. Automatic Control 40 (1995); Swevers, Ganseman, Tukel, De Schutter and
Van Brussel, Optimal robot excitation and identification, IEEE Trans. Robotics and Automation 13 (1997); De
Luca, Albu-Schaeffer, Haddadin and Hirzinger, Collision detection with the DLR-III lightweight arm, IROS
(2006); Strang, On the construction and comparison of difference schemes, SIAM J. Numerical Analysis 5
(1968); Hanselman, Resolver signal requirements for high accuracy, IEEE Trans. Industrial Electronics 37
(1990).
"""

from tests.campaigns.blind.families.robot_joint.case import draw

__all__ = ["draw"]
