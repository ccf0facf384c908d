"""Confidence of a name: no rival predicts better, and names with that held-out gain were as often true.

The second part is a logistic curve over the gain on held-out blocks, fitted to 408 names (14 of them
false) of the blind trials' training seeds 0 to 59 and 300 to 428 by
`tests/campaigns/bench/confidence_fit.py`. Scored seeds took no part in it.
"""

import math

INTERCEPT, SLOPE = 3.1, 0.8
"""Of the log odds of a true name over the log odds of the held-out gain."""
GAIN_MARGIN = 0.005
"""Distance from 0 and 1 to which gains are clipped: log odds are finite."""


def confidence(best_rival: float, heldout_gain: float) -> float:
    """Probability that a name is true.

    `best_rival`: probability that another effect predicts held-back blocks better; `heldout_gain`: share of
    the unexplained variance on held-out blocks.
    """
    return (1.0 - best_rival) * true_share(heldout_gain)


def true_share(heldout_gain: float) -> float:
    """Share of true names among those of this gain."""
    gain = min(max(heldout_gain, GAIN_MARGIN), 1.0 - GAIN_MARGIN)
    return 1.0 / (1.0 + math.exp(-INTERCEPT - SLOPE * math.log(gain / (1.0 - gain))))
