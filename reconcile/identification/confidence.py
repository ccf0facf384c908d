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


INDEPENDENT_S = 0.05
"""Time between samples of held-out blocks that are evidence of their own, s: twice the memory of the state
filter."""


def confidence(best_rival: float, heldout_gain: float, held_out_s: float = math.inf) -> float:
    """Probability that a name is true.

    `best_rival`: probability that another effect predicts held-back blocks better; `heldout_gain`: share of
    the unexplained variance on held-out blocks; `held_out_s`: their duration in motion.
    """
    return (1.0 - best_rival) * min(true_share(heldout_gain), largest(held_out_s))


def largest(held_out_s: float) -> float:
    """Largest confidence that blocks of this duration give, however well all of them are predicted.

    Source: Laplace's rule of succession, (n + 1) / (n + 2) after n successes out of n.
    """
    count = held_out_s / INDEPENDENT_S
    return 1.0 - 1.0 / (count + 2.0)


def true_share(heldout_gain: float) -> float:
    """Share of true names among those of this gain."""
    gain = min(max(heldout_gain, GAIN_MARGIN), 1.0 - GAIN_MARGIN)
    return 1.0 / (1.0 + math.exp(-INTERCEPT - SLOPE * math.log(gain / (1.0 - gain))))
