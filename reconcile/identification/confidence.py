"""Confidence of a name: the probability that no rival predicts better, times that of a true name at its gain.

The second probability is a logistic curve over the gain on held-out blocks, fitted to 408 names (14 of them
false) of the blind trials' training seeds 0 to 59 and 300 to 428 by
`tests/campaigns/bench/confidence_fit.py`. Scored seeds took no part in it.
"""

import math

INTERCEPT, SLOPE = 3.1, 0.8
"""Of the line that gives the log odds of a true name from the log odds of the held-out gain."""
GAIN_MARGIN = 0.005
"""Distance from 0 and 1 to which gains are clipped, so that log odds are finite."""
INDEPENDENT_S = 0.05
"""Time between independent samples of held-out blocks, s: twice the memory of the state filter."""


def confidence(best_rival: float, heldout_gain: float, held_out_s: float = math.inf) -> float:
    """Probability that a name is true.

    `best_rival`: probability that another effect predicts held-back blocks better; `heldout_gain`: share of
    the unexplained variance on held-out blocks; `held_out_s`: their duration in motion.
    """
    return (1.0 - best_rival) * min(true_share(heldout_gain), largest_confidence(held_out_s))


def largest_confidence(held_out_s: float) -> float:
    """Largest confidence that held-out blocks of this duration (s) can give.

    Source: Laplace's rule of succession, (n + 1) / (n + 2) after n successes out of n.
    """
    count = held_out_s / INDEPENDENT_S
    return 1.0 - 1.0 / (count + 2.0)


def true_share(heldout_gain: float) -> float:
    """Share of true names among those with this held-out gain."""
    gain = min(max(heldout_gain, GAIN_MARGIN), 1.0 - GAIN_MARGIN)
    return 1.0 / (1.0 + math.exp(-INTERCEPT - SLOPE * math.log(gain / (1.0 - gain))))
