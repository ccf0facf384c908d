"""The tilting (trunnion) axis of a five-axis machine: worm or roller cam, unbalanced load; rad and N m.

Kept out: no rule is fitted on its cases and no part of the tool is developed on them.

Sources: Dupont, Hayward, Armstrong and Altpeter, Single state elastoplastic friction models, IEEE Trans.
Automatic Control 47 (2002); Prandtl, Ein Gedankenmodell zur kinetischen Theorie der festen Koerper, ZAMM 8
(1928), for an element that is elastic below its yield; Newmark, A method of computation for structural
dynamics, J. Engineering Mechanics Division ASCE 85 (1959); Niemann and Winter, Maschinenelemente III,
Springer (1986), and Dudley, Handbook of Practical Gear Design, CRC (1994), for worm losses and the runout
of worm and wheel; Stribeck, Die wesentlichen Eigenschaften der Gleit- und Rollenlager, Zeitschrift VDI 46
(1902), with the exponential of Bo and Pavelescu, Wear 82 (1982); Vogel, Das Temperaturabhaengigkeitsgesetz
der Viskositaet von Fluessigkeiten, Physikalische Zeitschrift 22 (1921); Hanselman, Brushless Permanent
Magnet Motor Design (2003), for detent, ripple and saturation; Ellis, Observers in Control Systems, Academic
Press (2002), for the observer of the load; ISO 230-2 for the angles at which a table is measured.
"""

from tests.campaigns.blind.families.tilting_table.case import draw

__all__ = ["draw"]
