"""Whether the computer keeps the cycle: the share of missed ticks, and what the pages say about it."""

from collections import deque

from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.languages.texts import tr, word

WINDOW_CYCLES = 5000
"""Cycles of the share in the banner, five seconds at 1 kHz: it disappears with the overload. Chosen."""
TOO_MANY = 0.01
"""Share of missed ticks above which the computer is named: ten times what a quiet one misses. Chosen."""
FEWEST_CYCLES = 200
"""Bounds the cycles of which a share is computed from below; chosen."""
REMEDY = word(
    "End other programs on this computer; a simulator on it is starved by the same load: "
    "run both with --pacing lockstep."
)


def missed_share(status: MachineStatus) -> float:
    """Return the share of the ticks of the whole run that were missed, 0 to 1."""
    return status.missed_ticks / status.cycles if status.cycles >= FEWEST_CYCLES else 0.0


class RecentShare:
    """The share of missed ticks over the newest cycles of the run."""

    def __init__(self) -> None:
        self._samples: deque[tuple[int, int]] = deque()

    def take(self, status: MachineStatus) -> float:
        """Take a status; return the share since about WINDOW_CYCLES ago, 0 to 1."""
        samples, now = self._samples, (status.cycles, status.missed_ticks)
        if samples and now[0] < samples[-1][0]:  # the controller has restarted
            samples.clear()
        if not samples or now[0] > samples[-1][0]:
            samples.append(now)
        while len(samples) > 2 and samples[1][0] <= now[0] - WINDOW_CYCLES:
            samples.popleft()
        cycles, missed = (new - old for new, old in zip(now, samples[0], strict=True))
        return missed / cycles if cycles >= FEWEST_CYCLES else 0.0


def overload_text(share: float) -> str:
    """Return the text of the banner on this share of missed ticks; "" while the computer keeps the cycle."""
    if share < TOO_MANY:
        return ""
    return tr(
        "The computer misses {share:.0f} % of the ticks: it is too busy to control axes. {remedy}",
        share=100.0 * share,
        remedy=tr(REMEDY),
    )
