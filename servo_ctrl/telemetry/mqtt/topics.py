"""Names of the MQTT topics of one machine; docs/mqtt.md describes their payloads."""

import re

from servo_ctrl.commands.command import Right


def level(name: str) -> str:
    """Convert a name to one topic level: characters special to MQTT or a shell become "_"."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name)


class Topics:
    """The topics of one machine, all below `prefix/machine/`."""

    def __init__(self, prefix: str, machine_name: str) -> None:
        self.root = f"{prefix}/{level(machine_name)}"
        self.online = f"{self.root}/online"
        self.state = f"{self.root}/state"
        self.command = f"{self.root}/command"
        self.command_of = {right: f"{self.root}/command/{right}" for right in Right}
        self.ack = f"{self.root}/command/ack"
        self.stream = f"{self.root}/stream"
        self.stream_channels = f"{self.root}/stream/channels"

    def reversal(self, axis: str) -> str:
        """Return the topic of the reversals of an axis."""
        return f"{self.root}/axis/{axis}/reversal"

    def learning_due(self, axis: str) -> str:
        """Return the topic that says whether learning is due for an axis."""
        return f"{self.root}/axis/{axis}/learning_due"

    def learned(self, axis: str) -> str:
        """Return the topic of the learned functions of an axis."""
        return f"{self.root}/axis/{axis}/learned"

    def change(self, axis: str) -> str:
        """Return the topic of a detected change of an axis, which `reconcile watch` publishes."""
        return f"{self.root}/axis/{axis}/change"
