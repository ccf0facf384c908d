"""Watches during a motion of a tuning whether the client that requested it is connected and responds.

A client that is stopped (SIGSTOP) or hangs keeps its connection: only its silence shows that nobody waits for
the motion. Silence is counted in SYNC periods, as the renewal of a jog is.
"""

from servo_ctrl.commands.client_activity import ClientActivity

SILENCE_S = 3.0
"""Bounds the silence of a client in real time; the client bounds that of the controller alike. Chosen."""
LOCKSTEP_SILENCE_S = 20.0
"""Bounds it in lockstep, where cycles may run ten times as fast as the client's clock. Chosen."""
CONNECTION_LOST = "the connection that asked for it was lost"


class ClientWatch:
    """Made when the motion begins; `step` is called in each cycle of it."""

    def __init__(self, activity: ClientActivity, period_s: float, *, lockstep: bool) -> None:
        self.problem = ""
        """Why the motion has to end, else ""."""
        self._activity = activity
        self._silence_s = LOCKSTEP_SILENCE_S if lockstep else SILENCE_S
        self._limit_cycles = self._cycles_left = round(self._silence_s / period_s)
        self._requests = activity.requests

    def step(self) -> bool:
        """Count one cycle; return whether the motion has to end now, True once only."""
        if self.problem:
            return False
        if self._activity.requests != self._requests:
            self._requests, self._cycles_left = self._activity.requests, self._limit_cycles
        self._cycles_left -= 1
        if self._activity.disconnected:
            self.problem = CONNECTION_LOST
        elif self._cycles_left <= 0:
            self.problem = f"the program that asked for it was silent for {self._silence_s:g} s"
        return bool(self.problem)
