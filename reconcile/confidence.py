"""How sure a name is: no rival would do better, and names of that worth were true as often as said.

The second part is a curve over what the effect is worth on held-out blocks, fitted to 408 names (14 of
them false) of the blind trials' training seeds 0 to 59 and 300 to 428 by `tests/bench/confidence_fit.py`.
Scored seeds took no part in it.
"""

from __future__ import annotations

import math

LEVEL, SLOPE = 3.1, 0.8
"""Of the log odds, over those of the held-out gain."""
LEAST = 0.005


def confidence(best_rival: float, heldout_gain: float) -> float:
    """Probability that a name is true.

    `best_rival`: probability that another effect would predict unseen blocks better; `heldout_gain`: share of
    what is left without it, on held-out blocks.
    """
    return (1.0 - best_rival) * true_share(heldout_gain)


def true_share(heldout_gain: float) -> float:
    """Of the names of that worth."""
    gain = min(max(heldout_gain, LEAST), 1.0 - LEAST)
    return 1.0 / (1.0 + math.exp(-LEVEL - SLOPE * math.log(gain / (1.0 - gain))))
