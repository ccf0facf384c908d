"""Faults of the simulator: parsed from text, refused with a reason, started by simulated time."""

import re
from pathlib import Path

import pytest

from hil_sim.config import load_plant
from hil_sim.drive.amplifier_device import Drive
from hil_sim.faults.fault_target import FaultError
from hil_sim.faults.schedule import Fault, fault_kinds, read_fault
from hil_sim.runner.bench import SimulatedMachine
from kernels.quantities import fields_of

ROOT = Path(__file__).parents[3]


def test_fault_is_read_with_its_axis_time_and_parameters() -> None:
    fault = read_fault("mute_node:x@3.2,duration_s=0.25")
    assert (fault.kind, fault.axis, fault.at_s, fault.params.duration_s) == ("mute_node", "x", 3.2, 0.25)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "give KIND:AXIS@SECONDS"),
        ("broken_scale:x", "give KIND:AXIS@SECONDS"),
        ("earthquake:x@1", "there is no 'earthquake', only broken_scale"),
        ("broken_scale:x@soon", "'soon' is not a number"),
        ("broken_scale:x@nan", "'nan' is not a number"),
        ("broken_scale:x@-1", "the time must be 0 or later"),
        ("broken_scale:x@1,depth=2", "broken_scale has no 'depth', only nothing"),
        ("limit_switch:x@1,side=7", "side is not within its bounds"),
        ("limit_switch:x@1,side", "'' is not a number"),
    ],
)
def test_an_invalid_fault_is_refused_with_the_reason(text: str, reason: str) -> None:
    with pytest.raises(FaultError) as refused:
        read_fault(text)
    assert reason in str(refused.value)


@pytest.fixture(scope="module")
def emps() -> Path:
    """A machine without a scale and without compliance."""
    return ROOT / "machines" / "emps"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("broken_scale:x@1", "axis x has no scale"),
        ("node_death:x@1,scale=1", "axis x has no scale"),
        ("slipped_coupling:x@1", "motor and table are one mass"),
        ("jammed_axis:q@1", "there is no axis 'q', only x"),
    ],
)
def test_fault_that_an_axis_cannot_have_is_refused(emps: Path, text: str, reason: str) -> None:
    with pytest.raises(FaultError, match=reason):
        SimulatedMachine(load_plant(emps), lambda _id, _data: None, None, [read_fault(text)])


def test_faults_begin_in_order_of_time_whatever_the_order_of_words() -> None:
    sent: list[int] = []
    faults = [read_fault("limit_switch:y@0.005"), read_fault("mute_node:x@0.002,duration_s=0.001")]
    bench = SimulatedMachine(
        load_plant(ROOT / "machines" / "xy_table"), lambda can_id, _data: sent.append(can_id), None, faults
    )
    bench.start()
    drives = {device.slave.node_id: device for device in bench.devices if isinstance(device, Drive)}
    muted, closed = [], []
    for _ in range(8):
        bench.advance_cycle()
        muted.append(drives[1].slave.mute)
        closed.append(drives[2].port.switches())
    assert muted == [False, True, False, False, False, False, False, False]
    assert closed == [0, 0, 0, 0, 2, 2, 2, 2]


@pytest.mark.parametrize("kind", sorted(fault_kinds()))
def test_every_fault_can_begin_at_power_up_and_is_announced(kind: str) -> None:
    module = fault_kinds()[kind]
    assert module.__doc__
    fault = Fault(kind, "x", 0.0, module.Params())
    bench = SimulatedMachine(
        load_plant(ROOT / "machines" / "xy_table"), lambda _id, _data: None, None, [fault]
    )
    bench.start()
    bench.advance_cycle()


def test_document_names_every_fault_and_its_keys() -> None:
    lines = (ROOT / "docs" / "fault_policy.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line.startswith("|")]
    named = {row[0]: row[2] for row in rows if len(row) == 3 and row[0] not in {"kind", "---"}}
    keys = {kind: [field.key for field in fields_of(fault.Params)] for kind, fault in fault_kinds().items()}
    assert {kind: re.findall(r"`(\w+)`", cell) for kind, cell in named.items()} == keys
