"""Boot against scripted canopen nodes on a virtual bus: objects written, nodes refused."""

import asyncio
import re
from typing import Any

import pytest
from canopen.sdo import SdoAbortedError

from servo_ctrl.canopen.boot import boot_nodes
from servo_ctrl.canopen.errors import BootError
from servo_ctrl.canopen.node_plan import NodePlan

PATIENCE_S = 0.05
TRIES_OF_A_BUSY_COMPUTER = 1000
"""A node in this process answers once it gets a processor."""
"""SDO timeout for nodes that do not answer; ten tries of it make an absent node."""


def writes_to(node: Any) -> list[tuple[int, int, bytes]]:
    """From now on, what is written to the node."""
    log: list[tuple[int, int, bytes]] = []
    node.add_write_callback(lambda index, subindex, data, **_: log.append((index, subindex, bytes(data))))
    return log


def little(value: int, size: int) -> bytes:
    return value.to_bytes(size, "little")


async def test_pdos_are_remapped_by_the_standard_sequence(bench: Any, plans: tuple[NodePlan, ...]) -> None:
    log = writes_to(bench.add(plans[0]))
    await boot_nodes(bench.network, plans[:1])
    rpdo = [entry for entry in log if entry[0] in {0x1400, 0x1600}]
    assert rpdo == [
        (0x1400, 1, little(0x80000201, 4)),
        (0x1400, 2, b"\x01"),
        (0x1600, 0, b"\x00"),
        (0x1600, 1, little(0x60400010, 4)),
        (0x1600, 2, little(0x60600008, 4)),
        (0x1600, 3, little(0x60710010, 4)),
        (0x1600, 4, little(0x60B20010, 4)),
        (0x1600, 0, b"\x04"),
        (0x1400, 1, little(0x00000201, 4)),
    ]
    assert [entry for entry in log if entry[0] == 0x1800][-1] == (0x1800, 1, little(0x00000181, 4))


async def test_timing_watching_and_limits_reach_the_drive(bench: Any, plans: tuple[NodePlan, ...]) -> None:
    log = writes_to(bench.add(plans[0]))
    await boot_nodes(bench.network, plans[:1])
    assert (0x1006, 0, little(1000, 4)) in log
    assert (0x1017, 0, little(100, 2)) in log
    assert (0x1016, 1, little(127 << 16 | 300, 4)) in log
    # 100 mm at 10 mm a turn of 2^20 counts
    assert (0x607D, 2, little(10 * 2**20, 4)) in log
    assert (0x6098, 0, little(37, 1)) in log


async def test_all_nodes_leave_operational_first(bench: Any, plans: tuple[NodePlan, ...]) -> None:
    for plan in plans:
        bench.add(plan)
    await boot_nodes(bench.network, plans)
    assert bench.sent[:4] == [(0, bytes((0x80, plan.node_id))) for plan in plans]


async def test_all_dead_nodes_are_reported_together(bench: Any, plans: tuple[NodePlan, ...]) -> None:
    bench.add(plans[0])
    with pytest.raises(BootError) as caught:
        await boot_nodes(bench.network, plans, PATIENCE_S, tries=40)
    message = str(caught.value)
    assert len(caught.value.failures) == 3
    assert message.startswith("3 nodes cannot be used: ")
    silent = ", ".join(f"{plan.key} (node {plan.node_id})" for plan in plans[1:])
    assert f"{silent}: absent, no answer from 1000h in 40 tries; check power" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("answers", "complaint"),
    [
        ({"x1000_00": 0x00020191}, r"a foreign node: 1000h:00 \(device type\) is 0x00020191"),
        ({"x1018_01": 0x2A}, r"a foreign node: 1018h:01 \(vendor-ID\) is 0x0000002A"),
        ({"x1018_02": 0x2A}, r"a foreign node: 1018h:02 \(product code\)"),
        ({"x1018_03": 0x2A}, r"a foreign node: 1018h:03 \(revision number\)"),
        ({"x6076_00": 999}, r"6076h:00 is 999, the machine file says \d+ \(axis.x.drive.rated_torque_mnm\)"),
        ({"x6091_01": 2}, r"has 524288 positions a motor revolution \(608Fh = 1048576/1, 6091h = 2/1"),
        ({"x6092_01": 10_000}, r"has 10000 positions .* says 1048576 \(axis.x.drive.counts_per_rev\)"),
        ({"x6096_02": 60}, r"scales velocities by 6096h = 1/60; set it to 1/1"),
        ({"x60A8_00": 0x004A0000}, r"positions in a unit that is not known here, 60A8h = 004A0000h"),
        ({"x60A8_00": 0xFD410000}, r"has 360000 positions a motor revolution"),
        ({"x60A9_00": 0x00B44700}, r"60A9h = 00B44700h, the machine file says 00B50300h, counts/s"),
        ({"x6502_00": 0x1}, r"6502h:00 is 1, the machine file says 544 \(axis.x.mode\)"),
    ],
)
async def test_foreign_or_differently_scaled_node_is_refused(
    bench: Any, plans: tuple[NodePlan, ...], answers: dict[str, int], complaint: str
) -> None:
    log = writes_to(bench.add(plans[0], **answers))
    with pytest.raises(BootError, match=complaint) as caught:
        await boot_nodes(bench.network, plans[:1])
    assert "axis.x.drive (node 1)" in str(caught.value)
    assert not log, "a node that is not the right one is left alone"


async def test_refused_mapping_names_node_object_and_abort(bench: Any, plans: tuple[NodePlan, ...]) -> None:
    def refuse(index: int, subindex: int, **_: object) -> None:
        if (index, subindex) == (0x1600, 3):
            raise SdoAbortedError(0x06040041)

    bench.add(plans[0]).add_write_callback(refuse)
    with pytest.raises(BootError) as caught:
        await boot_nodes(bench.network, plans[:1])
    assert re.search(
        r"axis\.x\.drive \(node 1\): map target_torque: writing 1600h:03 was refused: .*cannot be mapped",
        str(caught.value),
    )


async def test_node_that_restarts_while_it_is_configured_is_refused(
    bench: Any, plans: tuple[NodePlan, ...]
) -> None:
    """Its default mapping may have the length of ours, and its numbers another meaning."""

    def brownout(index: int, subindex: int, **_: object) -> None:
        if (index, subindex) == (0x1600, 0):
            bench.far.send_message(0x701, b"\x00")

    bench.add(plans[0]).add_write_callback(brownout)
    with pytest.raises(BootError, match=r"axis.x.drive \(node 1\): restarted while it was configured"):
        await boot_nodes(bench.network, plans[:1])


async def test_node_switched_on_during_boot_is_accepted(bench: Any, plans: tuple[NodePlan, ...]) -> None:
    booting = asyncio.create_task(
        boot_nodes(bench.network, plans[:1], PATIENCE_S, tries=TRIES_OF_A_BUSY_COMPUTER)
    )
    requests_to_it = 0x600 + plans[0].node_id
    while [can_id for can_id, _ in bench.sent].count(requests_to_it) < 2:
        assert not booting.done()
        await asyncio.sleep(0.2 * PATIENCE_S)
    node = bench.add(plans[0])
    node.nmt.state = "INITIALISING"
    node.nmt.state = "PRE-OPERATIONAL"
    await booting
