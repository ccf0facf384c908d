"""Nodes that are lost in a machine that stands by: they return, boot and home by operator commands."""

import pytest
from ideal_drives import Operate

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage


class PretendedNodes:
    """`answering` are those that answer; `problem` is the objection."""

    def __init__(self) -> None:
        self.answering: set[int] = set()
        self.problem = self.at_end = ""
        self.changed: dict[int, str] = {}
        self.booting: list[int] = []
        self.used: list[int] = []

    def returned(self, lost: frozenset[int]) -> list[int]:
        return sorted(self.answering & set(lost))

    def objection(self, lost: frozenset[int]) -> str:
        assert lost is not None
        return self.problem

    def give_up(self, place: int) -> None:
        self.answering.discard(place)

    def to_boot(self, lost: frozenset[int]) -> list[int]:
        return sorted(lost)

    def keeps_position(self, node: int) -> bool:
        return node in self.changed

    def begin_boot(self, nodes: list[int]) -> None:
        self.booting = nodes

    def not_booted(self, nodes: tuple[int, ...]) -> None:
        assert list(nodes) == self.booting

    def booted(self, nodes: tuple[int, ...]) -> str:
        assert list(nodes) == self.booting
        return self.at_end

    def mark_operational(self, nodes: tuple[int, ...]) -> None:
        self.used += nodes


def test_lost_node_may_return(enabled: Operate) -> None:
    made = enabled()
    nodes = PretendedNodes()
    made.machine.nodes = nodes  # type: ignore[assignment]  # what the machine asks of them
    made.absent = {2}
    made.run(30)
    assert made.machine.stage is Stage.STANDBY
    assert made.status.reason == "dy: its TPDOs are no longer received"
    assert (made.status.drives[1].phase, made.status.drives[1].state) == ("lost", "not responding")
    nodes.answering, made.absent = {2}, set()
    made.run(5)
    assert made.status.drives[1].state == "switch on disabled"
    assert made.machine.events.kept[-1] == "dy: its TPDOs are received again"
    nodes.problem = "it is silent"
    assert made.ask(Command.ENABLE).reason == "it is silent"
    nodes.problem = ""
    assert made.ask(Command.ENABLE).accepted
    made.run(100)
    assert made.machine.stage is Stage.READY


def test_node_that_was_lost_is_booted_and_homed_before_its_axis_gets_power(enabled: Operate) -> None:
    made = enabled(homing_method=37)
    nodes = PretendedNodes()
    made.machine.nodes = nodes  # type: ignore[assignment]  # the same
    made.absent = {2}
    made.run(30)
    assert made.ask(Command.ENABLE).accepted
    assert (nodes.booting, made.status.setting_up, made.machine.stage) == ([2], True, Stage.STANDBY)
    assert made.ask(Command.ENABLE).reason == "dy: is being configured again; wait for its end"
    made.machine.booted("dy: absent")
    assert (made.status.setting_up, made.machine.events.kept[-1]) == (False, "not enabled: dy: absent")

    assert made.ask(Command.ENABLE).accepted
    nodes.at_end = "dy: restarted while it was configured"
    made.machine.booted()
    assert made.machine.events.kept[-1] == f"not enabled: {nodes.at_end}"

    nodes.at_end = ""
    assert made.ask(Command.ENABLE).accepted
    made.machine.booted()
    made.run(20)
    assert made.machine.stage is Stage.STANDBY, "its inputs do not come yet"
    nodes.answering, made.absent = {2}, set()
    made.run(2)
    assert (made.machine.stage, nodes.used) == (Stage.STARTING, [2])
    assert [drive.homed for drive in made.status.drives] == [True, False]
    made.run(200)
    assert made.machine.stage is Stage.READY
    assert [drive.homed for drive in made.status.drives] == [True, True]


@pytest.mark.parametrize("stop", [Command.QUICK_STOP, Command.DISABLE])
def test_a_stop_while_nodes_are_set_up_leaves_the_drives_without_power(
    enabled: Operate, stop: Command
) -> None:
    made = enabled()
    nodes = PretendedNodes()
    made.machine.nodes = nodes  # type: ignore[assignment]  # the same
    made.absent = {2}
    made.run(30)
    assert made.ask(Command.ENABLE).accepted
    assert made.ask(stop).accepted
    nodes.answering, made.absent = {2}, set()
    made.machine.booted()
    made.run(100)
    assert (made.machine.stage, made.status.setting_up) == (Stage.STANDBY, False)
    assert made.ask(Command.ENABLE).accepted
    made.run(100)
    assert made.machine.stage is Stage.READY
