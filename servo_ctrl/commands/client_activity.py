"""The activity of a client of the local socket, by which a motion ends when nobody attends to it."""


class ClientActivity:
    """Whether a client is still connected, and its requests."""

    def __init__(self) -> None:
        self.disconnected = False
        """Whether its connection was lost."""
        self.requests = 0
        """Its requests so far, `heartbeat` included."""
