"""Nodes that are booted again between Enable and power: which, how far, and whether power is still wanted."""

from collections.abc import Collection


class SettingUp:
    """Idle at first."""

    def __init__(self) -> None:
        self.nodes: tuple[int, ...] = ()
        """Those that are set up now; empty while there are none."""
        self.started = False
        """They are configured and started; their inputs are awaited."""
        self._power_wanted = False

    def begin(self, nodes: Collection[int]) -> None:
        """Set these up, and switch the drives on afterwards."""
        self.nodes, self.started, self._power_wanted = tuple(nodes), False, True

    def call_off(self) -> bool:
        """Leave the drives without power afterwards, as somebody asked for a stop; whether that is new."""
        wanted = bool(self.nodes) and self._power_wanted
        self._power_wanted = False
        return wanted

    def end(self) -> bool:
        """All of it is over; return whether power is still wanted."""
        wanted, self.nodes, self.started = self._power_wanted, (), False
        return wanted
