"""The state of nodes that boot again between Enable and power-on."""

from collections.abc import Collection


class NodeBoot:
    """No node boots at first."""

    def __init__(self) -> None:
        self.nodes: tuple[int, ...] = ()
        """Indices of the nodes that boot now."""
        self.started = False
        """Whether these nodes are configured and started, so that only their inputs are awaited."""
        self._power_requested = False

    def begin(self, nodes: Collection[int]) -> None:
        """Note that these nodes boot and that their drives get power afterwards."""
        self.nodes, self.started, self._power_requested = tuple(nodes), False, True

    def cancel_power(self) -> bool:
        """Leave the power off after the boot, because a stop was requested; return whether that is new."""
        power = bool(self.nodes) and self._power_requested
        self._power_requested = False
        return power

    def end(self) -> bool:
        """Note that the boot is over; return whether the drives still get power."""
        power, self.nodes, self.started = self._power_requested, (), False
        return power
