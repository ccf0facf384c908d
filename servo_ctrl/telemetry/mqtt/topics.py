"""Names of the MQTT topics of one machine; docs/mqtt.md describes their payloads."""

import re

from servo_ctrl.commands.command import Right


def level(name: str) -> str:
    """A name as one level of a topic: characters with a meaning in MQTT or in a shell become "_"."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name)


class Topics:
    """Everything is under `prefix/machine/`."""

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
        """The report of each reversal of an axis."""
        return f"{self.root}/axis/{axis}/reversal"

    def learning_due(self, axis: str) -> str:
        """Whether learning is due for an axis."""
        return f"{self.root}/axis/{axis}/learning_due"

    def learned(self, axis: str) -> str:
        """The learned functions that an axis has."""
        return f"{self.root}/axis/{axis}/learned"

    def change(self, axis: str) -> str:
        """That an axis is no longer what it was; `reconcile watch` publishes it, beside the controller."""
        return f"{self.root}/axis/{axis}/change"
