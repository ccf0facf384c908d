"""The client of the local socket that asks for a motion which must not outlast its attention."""


class Asker:
    """Whether a client is still there, and how often it was heard."""

    def __init__(self) -> None:
        self.gone = False
        """Whether its connection was lost."""
        self.requests = 0
        """Its requests so far, `heartbeat` included."""
