"""The state of nodes that boot again between Enable and power-on."""

from collections.abc import Collection


class SettingUp:
    """No node boots at first."""

    def __init__(self) -> None:
        self.nodes: tuple[int, ...] = ()
        """Indices of the nodes that boot now."""
        self.started = False
        """Whether these nodes are configured and started, so that only their inputs are awaited."""
        self._power_wanted = False

    def begin(self, nodes: Collection[int]) -> None:
        """Note that these nodes boot and that their drives get power afterwards."""
        self.nodes, self.started, self._power_wanted = tuple(nodes), False, True

    def cancel_power(self) -> bool:
        """Leave the power off after the boot, because a stop was requested; return whether that is new."""
        wanted = bool(self.nodes) and self._power_wanted
        self._power_wanted = False
        return wanted

    def end(self) -> bool:
        """Note that the boot is over; return whether the drives still get power."""
        wanted, self.nodes, self.started = self._power_wanted, (), False
        return wanted
