"""The suite on our nodes, on twenty that each break one clause."""

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from controller_node_bench import NODE_ID, ControllerNodeBench
from in_process_nodes import DRIVE, EDS, SCALE, InProcessNodes

from servo_ctrl.conformance import dialogue, verdicts
from servo_ctrl.conformance.scan import scan
from servo_ctrl.conformance.suite import examine
from servo_ctrl.conformance.verdicts import ClauseFinding, Verdict

Frame = tuple[int, bytes]
ANSWER = 0x580 + DRIVE


class InProcessWire:
    """Nodes in this process: a cycle passes whenever nothing has come. `change` may alter what they send."""

    def __init__(self, change: Callable[[int, bytes, Frame], Frame | None] | None = None) -> None:
        self.nodes = InProcessNodes()
        self._change = change
        self._asked: Frame = (0, b"")
        self.nodes.frames.clear()

    def send(self, can_id: int, data: bytes) -> None:
        if can_id != 0x80:
            self._asked = (can_id, data)
        self.nodes.put(can_id, data)

    def receive(self, timeout_s: float) -> Frame | None:
        for _ in range(60 if timeout_s else 1):
            while self.nodes.frames:
                frame = self.nodes.frames.pop(0)
                changed = self._change(*self._asked, frame) if self._change else frame
                if changed is not None:
                    return changed
            if timeout_s:
                self.nodes.bench.advance_cycle()
                self.nodes.bench.run_timers()
        return None


def run(
    wire: InProcessWire, node_id: int = DRIVE, eds: Path = EDS / "servo_drive.eds"
) -> list[ClauseFinding]:
    return list(examine(wire, node_id, eds))


@pytest.mark.parametrize(("node_id", "eds"), [(DRIVE, "servo_drive.eds"), (SCALE, "linear_scale.eds")])
def test_our_nodes_meet_every_clause(node_id: int, eds: str) -> None:
    findings = run(InProcessWire(), node_id, EDS / eds)
    assert verdicts.failures(findings) == []
    assert sum(finding.verdict is Verdict.PASS for finding in findings) > 25


class ControllerWire:
    """The controller's own node in this process; a cycle passes whenever nothing has come."""

    def __init__(self) -> None:
        self.bench = ControllerNodeBench.booted()

    def send(self, can_id: int, data: bytes) -> None:
        if can_id == 0x80:
            self.bench.node.count_cycles(1)
        else:
            self.bench.put(can_id, data)

    def receive(self, timeout_s: float) -> Frame | None:
        for _ in range(60 if timeout_s else 1):
            if self.bench.frames:
                return self.bench.frames.pop(0)
            if timeout_s:
                self.bench.node.count_cycles(1)
        return None


def test_the_controllers_node_is_as_its_own_eds_describes_it(tmp_path: Path) -> None:
    """1021h has the axes that the machine has; the file in eds/ has all that a machine may have."""
    wire, eds = ControllerWire(), tmp_path / "own.eds"
    with wire.bench.remote.sdo[0x1021].open("rb", block_transfer=True) as stream:
        eds.write_bytes(stream.read())
    wire.bench.frames.clear()
    findings = list(examine(wire, NODE_ID, eds))
    assert verdicts.failures(findings) == []
    assert sum(finding.verdict is Verdict.PASS for finding in findings) > 25


def recoded(old: int, new: int) -> Callable[[int, bytes, Frame], Frame]:
    """A node that aborts with another code."""

    def change(_can_id: int, _data: bytes, frame: Frame) -> Frame:
        can_id, data = frame
        if can_id == ANSWER and data[0] == 0x80 and int.from_bytes(data[4:], "little") == old:
            return can_id, data[:4] + new.to_bytes(4, "little")
        return frame

    return change


def answering(request: str, answer: str | None) -> Callable[[int, bytes, Frame], Frame | None]:
    """A node with another answer to the requests that begin so (hex); None: without one."""

    def change(can_id: int, data: bytes, frame: Frame) -> Frame | None:
        if can_id == 0x600 + DRIVE and frame[0] == ANSWER and data.hex().startswith(request):
            return None if answer is None else (frame[0], bytes.fromhex(answer))
        return frame

    return change


def sending(
    can_id: int, change: Callable[[bytes], bytes | None]
) -> Callable[[int, bytes, Frame], Frame | None]:
    """A node whose frames of one identifier are others, or missing."""

    def altered(_can_id: int, _data: bytes, frame: Frame) -> Frame | None:
        if frame[0] != can_id:
            return frame
        data = change(frame[1])
        return None if data is None else (can_id, data)

    return altered


PLANTED = {
    "device type": answering("40001000", "4300100091010200"),
    "no object as no sub-index": recoded(0x06020000, 0x06090011),
    "no sub-index as no object": recoded(0x06090011, 0x06020000),
    "write of read only as general error": recoded(0x06010002, 0x08000000),
    "too long as general error": recoded(0x06070012, 0x08000000),
    "too short as general error": recoded(0x06070013, 0x08000000),
    "too high as general error": recoded(0x06090031, 0x08000000),
    "toggle bit unchecked": recoded(0x05030000, 0x05040001),
    "stray segment as no data": recoded(0x05040001, 0x08000024),
    "abort without its object": answering("4018107f", "8000000011000906"),
    "segment without toggle": answering("70000000000000", "0064657365727665"),
    "size announced wrong": answering("40081000", "4108100016000000"),
    "block segment out of order": answering("a3000000000000", "0253696d756c6174"),
    "block CRC wrong": answering("a2037f", "c100000000000000"),
    "object of another length": answering("40171000", "4f17100000000000"),
    "vendor of another": answering("40181001", "43181001efbeadde"),
    "EMCY of another node": answering("40141000", "4314100085000000"),
    "mapping changed while on": answering("2f001a00", "60001a0000000000"),
    "heartbeat state wrong": sending(0x700 + DRIVE, lambda data: b"\x7f" if data[0] else data),
    "no boot-up": sending(0x700 + DRIVE, lambda data: data if data[0] else None),
    "TPDO too short": sending(0x180 + DRIVE, lambda data: data[:-1]),
    "statusword stuck": answering("40416000", "4b41600040020000"),
}


@pytest.mark.parametrize("name", sorted(PLANTED))
def test_a_planted_defect_is_found(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dialogue, "RESPONSE_LIMIT_S", 0.02)
    monkeypatch.setattr(dialogue, "LATE_RESPONSE_S", 0.02)
    failed = verdicts.failures(run(InProcessWire(PLANTED[name])))
    assert 1 <= len(failed) <= 6, failed


class LateWire:
    """Receives what the script says, None where nothing has come in time."""

    def __init__(self, *script: Frame | None) -> None:
        self._script = list(script)

    def send(self, can_id: int, data: bytes) -> None:
        """Every request is taken."""

    def receive(self, _timeout_s: float) -> Frame | None:
        """The next of the script."""
        return self._script.pop(0)


def test_a_late_answer_is_reported_and_not_taken_for_the_next_one() -> None:
    late, own = (ANSWER, bytes.fromhex("4300100092010200")), (ANSWER, bytes.fromhex("4f01100000000000"))
    node = dialogue.Dialogue(LateWire(None, None, late, None, own), DRIVE)
    with pytest.raises(dialogue.Failed, match=r"within 0.5 s, but within 2.5 s"):
        node.read(0x1000)
    assert node.read(0x1001) == b"\0"


def test_reports_say_the_same() -> None:
    findings = run(InProcessWire(PLANTED["block CRC wrong"]))
    assert verdicts.count(findings).split(", ")[1] == "1 fail"
    suite = ET.fromstring(verdicts.junit(findings, "node 1"))  # noqa: S314  # it is ours
    assert (suite.get("tests"), suite.get("failures")) == (str(len(findings)), "1")
    assert len(suite.findall("testcase/failure")) == 1
    page = verdicts.page(findings, "a <node>")
    assert "a &lt;node&gt;" in page
    assert page.count("<tr class=") == len(findings)


def test_the_nodes_of_a_bus_are_named() -> None:
    drive, scale = scan(InProcessWire())
    assert (drive.node_id, drive.profile, drive.vendor, drive.product) == (DRIVE, 402, 0xFFFE, 0x402)
    assert drive.line.startswith("node   1  CiA 402 drive ")
    assert drive.line.endswith("Simulated servo drive")
    assert (scale.node_id, scale.profile) == (SCALE, 406)
    assert scale.serial not in {drive.serial, 0, None}
