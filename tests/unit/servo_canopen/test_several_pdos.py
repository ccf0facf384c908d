"""PDOs beyond the first, identifiers and mappings from the machine file, and concise DCF."""

import struct
from pathlib import Path
from typing import Any

import pytest
from machine_files import text_of, write_controller

from servo_ctrl.canopen.boot import boot_nodes
from servo_ctrl.canopen.concise_dcf import SdoDownload, read_concise_dcf
from servo_ctrl.canopen.errors import BootError, EdsError
from servo_ctrl.canopen.node_plan import NodePlan
from servo_ctrl.canopen.plan import plan_machine
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ConfigError

FURTHER = """
[axis.x.drive.pdo.rpdo1]
cob_id = 0x321

[axis.x.drive.pdo.rpdo2]
objects = ["velocity_offset", "0x60B0:00"]

[axis.x.drive.pdo.tpdo2]
objects = ["torque_actual_value", "modes_of_operation_display"]

[axis.x.drive.pdo.tpdo3]
objects = ["error_code", "digital_inputs"]
cob_id = 0x3A1
transmission_type = 255
event_timer_ms = 50
inhibit_ms = 2.5

[axis.x.scale]"""


def planned(table: MachineConfig, folder: Path, further: str = FURTHER, **changes: str) -> NodePlan:
    text = text_of(
        table.source, {"limit_switch_syncs = 10": "", "[axis.x.scale]": further, **changes}, occurrences=1
    )
    return plan_machine(load_machine(write_controller(folder, text)))[0]


async def test_further_pdos_are_mapped_with_identifier_type_and_timers(
    bench: Any, table: MachineConfig, tmp_path: Path
) -> None:
    plan = planned(table, tmp_path)
    log: list[tuple[int, int, int]] = []
    bench.add(plan).add_write_callback(
        lambda index, subindex, data, **_: log.append((index, subindex, int.from_bytes(data, "little")))
    )
    await boot_nodes(bench.network, [plan])
    assert [
        entry
        for entry in log
        if entry[0] in {0x1400, 0x1401, 0x1601} and entry[:2] not in {(0x1400, 2), (0x1401, 2)}
    ] == [
        (0x1400, 1, 0x80000321),
        (0x1400, 1, 0x321),
        (0x1401, 1, 0x80000301),
        (0x1601, 0, 0),
        (0x1601, 1, 0x60B10020),
        (0x1601, 2, 0x60B00020),
        (0x1601, 0, 2),
        (0x1401, 1, 0x301),
    ]
    assert [entry for entry in log if entry[0] == 0x1802] == [
        (0x1802, 1, 0x800003A1),
        (0x1802, 2, 255),
        (0x1802, 3, 25),
        (0x1802, 5, 50),
        (0x1802, 1, 0x3A1),
    ]
    assert [pdo.name for pdo in plan.further_tpdos if pdo.cyclic] == ["TPDO 2"]
    assert plan.switches is not None
    assert plan.switches.name == "TPDO 3"


@pytest.mark.parametrize(
    ("text", "other", "complaint"),
    [
        ("cob_id = 0x3A1", "cob_id = 0x182", r"tpdo1.cob_id: 182h is that of TPDO 3 of axis.x.drive"),
        ("cob_id = 0x3A1", "cob_id = 0x081", r"x.drive.pdo.tpdo3.cob_id: 081h is that of EMCY of node 1"),
        ("cob_id = 0x3A1", "cob_id = 0x601", "tpdo3.cob_id: 601h is restricted: no PDO may have it"),
        ("cob_id = 0x3A1", "cob_id = 0x1FF", "1FFh is that of the status TPDO of node 127"),
        (
            '"velocity_offset", "0x60B0:00"',
            '"target_torque", "0x6083:00"',
            "drive.rpdo2: profile_acceleration",
        ),
        ("pdo.tpdo3", "pdo.tpdo9", "tpdo9: .* has no such PDO"),
        ("cob_id = 0x321", 'objects = ["controlword"]', "objects and type of PDO 1 are rpdo1"),
        ("cob_id = 0x3A1", "cob_id = 0x3A1\nspeed = 1", "tpdo3.speed: unknown key"),
    ],
)
def test_what_cannot_be_is_refused_by_its_key(
    table: MachineConfig, tmp_path: Path, text: str, other: str, complaint: str
) -> None:
    with pytest.raises(ConfigError, match=complaint):
        planned(table, tmp_path, FURTHER.replace(text, other))


def pack_concise_dcf(entries: list[SdoDownload]) -> bytes:
    head = (struct.pack("<HBI", one.index, one.subindex, len(one.data)) for one in entries)
    parts = zip(head, (one.data for one in entries), strict=True)
    return struct.pack("<I", len(entries)) + b"".join(start + data for start, data in parts)


async def test_a_concise_dcf_is_written_before_the_machine_file(
    bench: Any, table: MachineConfig, tmp_path: Path
) -> None:
    entries = [SdoDownload(0x6065, 0, struct.pack("<I", 77)), SdoDownload(0x605E, 0, struct.pack("<h", 1))]
    (tmp_path / "node.bin").write_bytes(pack_concise_dcf(entries))
    plan = planned(table, tmp_path, 'concise_dcf = "node.bin"\n[axis.x.scale]')
    log: list[tuple[int, bytes]] = []
    bench.add(plan).add_write_callback(lambda index, data, **_: log.append((index, bytes(data))))
    await boot_nodes(bench.network, [plan])
    assert log[:2] == [(0x6065, entries[0].data), (0x605E, entries[1].data)]
    assert [index for index, _ in log].count(0x6065) == 2
    assert log[-1][0] not in {0x6065, 0x605E}


def test_a_concise_dcf_is_as_dcfgen_makes_it(tmp_path: Path) -> None:
    """Bytes of CiA 302-3 by hand: one entry, 1017h:00 = 1000."""
    block = bytes.fromhex("01000000 1710 00 02000000 e803")
    path = tmp_path / "a.bin"
    path.write_bytes(block)
    assert read_concise_dcf(path) == (SdoDownload(0x1017, 0, b"\xe8\x03"),)
    assert pack_concise_dcf([SdoDownload(0x1017, 0, b"\xe8\x03")]) == block
    for broken, complaint in ((block[:-1], "1017h:00, is cut off"), (block + b"\0", "1 bytes after")):
        path.write_bytes(broken)
        with pytest.raises(EdsError, match=complaint):
            read_concise_dcf(path)


async def test_a_mapping_that_cannot_be_written_is_held_against_the_file(
    bench: Any, table: MachineConfig, tmp_path: Path, value_setter: Any
) -> None:
    eds = text_of(table.axes["x"].drive.eds)
    before, after = eds.split("[1A00sub0]")
    fixed = after.replace("AccessType=rw", "AccessType=const", 1)
    (tmp_path / "fixed.eds").write_text(f"{before}[1A00sub0]{fixed}", encoding="utf-8")
    axis = table.axes["x"]
    drive = axis.drive.model_copy(update={"eds": tmp_path / "fixed.eds"})
    axes = {**table.axes, "x": axis.model_copy(update={"drive": drive})}
    plan = plan_machine(table.model_copy(update={"axes": axes}))[0]
    assert plan.tpdo.fixed
    node = bench.add(plan)
    value_setter(node, 0x1A00, 0, 1)
    value_setter(node, 0x1A00, 1, 0x60410010)
    with pytest.raises(BootError, match="TPDO 1 maps 60410010h and cannot be changed"):
        await boot_nodes(bench.network, [plan])
