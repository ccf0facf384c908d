"""Watches during a motion of a tuning whether the client that asked for it is still there and responds.

A client that is stopped (SIGSTOP) or hangs keeps its connection: only its silence shows that nobody waits for
the motion. Silence is counted in SYNC periods, as the renewal of a jog is.
"""

from servo_ctrl.commands.asker import Asker

SILENCE_S = 3.0
"""Longest silence, after which the client takes a connection for lost, too. Chosen."""
LOCKSTEP_SILENCE_S = 20.0
"""In lockstep, where the cycles may run ten times as fast as the client's clock. Chosen."""
CONNECTION_LOST = "the connection that asked for it was lost"


class AskerWatch:
    """Made when the motion begins; `step` is called in each cycle of it."""

    def __init__(self, asker: Asker, period_s: float, *, lockstep: bool) -> None:
        self.problem = ""
        """Why the motion has to end, else ""."""
        self._asker = asker
        self._silence_s = LOCKSTEP_SILENCE_S if lockstep else SILENCE_S
        self._cycles = self._left = round(self._silence_s / period_s)
        self._heard = asker.requests

    def step(self) -> bool:
        """Count one cycle; return whether the motion has to end now, True once only."""
        if self.problem:
            return False
        if self._asker.requests != self._heard:
            self._heard, self._left = self._asker.requests, self._cycles
        self._left -= 1
        if self._asker.gone:
            self.problem = CONNECTION_LOST
        elif self._left <= 0:
            self.problem = f"the program that asked for it was silent for {self._silence_s:g} s"
        return bool(self.problem)
