"""A burst in one compiled call, its frames one by one, and drives and codecs of Python: the same frames."""

import random
import struct
from typing import Any

import pytest
from in_process_nodes import DRIVE, InProcessNodes, SdoDrive, counts

from can_frames.frame import FRAME, FRAME_BYTES, pack_frame
from hil_sim.drive.amplifier_device import Drive
from hil_sim.runner.bench import SimulatedMachine

MODES = {8: (0x607A, "i", counts(0.4)), 9: (0x60FF, "i", counts(60.0)), 10: (0x6071, "h", 900)}
"""Set point object, its type, and an amplitude that sometimes exceeds limits."""
ENABLING, ENABLED = (0x80, 0x06, 0x07, 0x0F), 0x0F
BLOCK = 40
"""Cycles with the same set point, the last third of them with another controlword of these."""
OTHER = 0x55
"""Node id that no consumer monitors."""
WORDS = (0x0F, 0x07, 0x06, 0x02, 0x00, 0x10F)


def mapped(node: Any, rpdo: list[int], tpdo: list[int]) -> None:
    node.tpdo.read()
    node.rpdo.read()
    pdos = [(node.tpdo[1], tpdo), *([(node.rpdo[1], rpdo)] if rpdo else [])]
    for pdo, objects in pdos:
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.trans_type = 1
        pdo.enabled = True
        pdo.save()


def put(nodes: InProcessNodes, burst: bytes) -> None:
    """Send frames as one burst, as the simulator's port passes them."""
    at = 0
    while (at := nodes.bench.serve_burst(burst, at)) < len(burst):
        can_id, size, data = FRAME.unpack_from(burst, at)
        nodes.bench.frames.handle(can_id, data[:size])
        at += FRAME_BYTES


def frames_of(mode: int, seed: int, *, in_bursts: bool = False) -> list[tuple[int, bytes]]:
    """Return the nodes' frames under a controller with random commands; odd seeds have one tick a cycle."""
    nodes = InProcessNodes()
    nodes.bench.cycle_us = 1000 if seed % 2 else 3000
    drive = SdoDrive(nodes)
    mapped_set_point, code, size = MODES[mode]
    drive.set(0x6065, counts(0.5))
    drive.set(0x607D, counts(-2.0), 1)
    drive.set(0x607D, counts(2.0), 2)
    mapped(drive.node, [0x6040, 0x6060, mapped_set_point], [0x6041, 0x6064, 0x6077])
    scale = nodes.remote(11)
    mapped(scale, [], [0x6004])
    nodes.operational()
    choice = random.Random(seed)
    for cycle in range(12 * BLOCK):
        at = cycle % BLOCK
        if at == 0:
            last, asked = choice.choice(WORDS), choice.choice((mode, mode, mode, 3))
            value = choice.randint(-size, size)
        word = ENABLING[at] if at < len(ENABLING) else ENABLED if at < 2 * BLOCK // 3 else last
        set_point = struct.pack("<Hb" + code, word, asked, value)[: None if choice.random() < 0.97 else 4]
        sent = [(0x200 + DRIVE, set_point)] * (choice.random() < 0.95) + [(0x080, b"")]
        sent += [(0x700 + OTHER, b"\5")] * (choice.random() < 0.1)
        if in_bursts:
            put(nodes, b"".join(pack_frame(*frame) for frame in sent))
        else:
            for frame in sent:
                nodes.put(*frame)
    return nodes.frames


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("mode", list(MODES))
def test_compiled_and_single_drives_send_the_same_frames(
    mode: int, seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = frames_of(mode, seed)
    assert frames_of(mode, seed, in_bursts=True) == compiled

    monkeypatch.setattr(Drive, "follows_set_points", property(lambda _drive: False))
    monkeypatch.setattr(SimulatedMachine, "_tables_of_all", lambda _bench: None)
    single = frames_of(mode, seed)
    assert compiled == single
    assert len({data for can_id, data in compiled if can_id == 0x180 + DRIVE}) > 20
