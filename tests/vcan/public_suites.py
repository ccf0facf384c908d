"""Public CANopen programs that are not ours, against the simulated nodes on vcan0, each twice in a row.

`make conformance` runs this in user-mode Linux. The programs are no part of the project: those that are not
on PATH are skipped with their names. CANOPENDEMO names a checkout of CANopenDemo, for its bats suite and the
description of its demo device.

    canopend, cocomm      CANopenLinux: gateway and its client
    demoLinuxDevice       CANopenDemo's device, the node that is not ours
    bats                  runs CANopenDemo/test; its libraries are Debian's bats-assert and bats-support
    dcfchk, dcfgen        Lely
    coctl                 Lely: its master, with the DCF of dcfgen
    cangen, tshark        can-utils, Wireshark
"""

import contextlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import canopen
import pytest

from servo_ctrl.canopen.concise_dcf import read_concise_dcf

pytestmark = pytest.mark.vcan

ROOT = Path(__file__).resolve().parents[2]
EDS = ROOT / "eds"
BUS, INTERFACE = "socketcan:vcan0", "vcan0"
GATEWAY, DRIVE, SCALE, DEMO = 0x20, 1, 11, 4
BATS_LIBRARIES = Path("/usr/lib/bats")
DOMAIN_OF_DEMO, DOMAIN_OF_DRIVE = "0x2122", "0x2000"
TWICE = pytest.mark.parametrize("turn", ["first", "second"])
LIMIT_S = 600.0


def installed(*names: str) -> pytest.MarkDecorator:
    """Skip where a program is missing."""
    missing = [name for name in names if shutil.which(name) is None]
    return pytest.mark.skipif(bool(missing), reason=f"{', '.join(missing)} not installed")


def run(*command: str, **options: object) -> subprocess.CompletedProcess[str]:
    """A command to its end, its output as text."""
    return subprocess.run(  # type: ignore[call-overload,no-any-return]  # options of ours only
        command, capture_output=True, text=True, timeout=LIMIT_S, check=False, **options
    )


@pytest.fixture(scope="module")
def simulator(start: Callable[..., object]) -> None:
    """The X-Y table by the wall clock: heartbeats come also while nobody sends a SYNC."""
    program = str(Path(sys.executable).with_name("hil-sim"))
    machine = ["--machine", "machines/xy_table", "--bus", BUS, "--pacing", "realtime"]
    start(program, "run", *machine, ready="hil-sim: on the bus")


@contextlib.contextmanager
def canopend(folder: Path) -> Iterator[Callable[..., str]]:
    """`canopend` as node 20h, commanded through cocomm."""
    socket = folder / "command"
    socket.unlink(missing_ok=True)
    command = ["canopend", INTERFACE, "-i", str(GATEWAY), "-c", f"local-{socket}", "-s", f"{folder}/od_"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        deadline_s = time.monotonic() + 60.0
        while not socket.exists():
            assert time.monotonic() < deadline_s
            time.sleep(0.05)

        def ask(*lines: str) -> str:
            environment = {**os.environ, "cocomm_socket": str(socket), "cocomm_flat": "1"}
            return run("cocomm", *lines, env=environment).stdout

        yield ask
        process.terminate()


@pytest.fixture
def gateway(simulator: None, tmp_path: Path) -> Iterator[Callable[..., str]]:
    """Started again once it has stored its parameters: without any it stays pre-operational for an error."""
    del simulator
    with canopend(tmp_path) as first:
        assert "OK" in first(f"[1] {GATEWAY} w 0x1010 1 vs save")
    with canopend(tmp_path) as ask:
        yield ask


@TWICE
@installed("canopend", "cocomm")
def test_canopenlinux_reads_commands_and_stores(gateway: Callable[..., str], turn: str) -> None:
    del turn
    assert gateway(f"[1] {DRIVE} r 0x1000 0 x32").split() == ["[1]", "0x00020192"]
    assert gateway(f"[1] {DRIVE} r 0x1018 1 x32").split() == ["[1]", "0x0000FFFE"]
    for command in (
        f"{DRIVE} start",
        f"{DRIVE} preop",
        f"{SCALE} start",
        f"{SCALE} preop",
        f"{DRIVE} w 0x1017 0 u16 200",
        f"{DRIVE} w 0x1010 1 u32 0x65766173",
        f"{DRIVE} w 0x1011 1 u32 0x64616F6C",
        f"{DRIVE} reset node",
    ):
        assert "OK" in gateway(f"[1] {command}"), command
    assert "ERROR:0x06020000" in gateway(f"[1] {DRIVE} r 0x5FFF 0 u8")


@TWICE
@pytest.mark.parametrize("suite", ["basic_NMT_SDO_heartbeat", "SDO_transfer"])
@installed("canopend", "cocomm", "bats", "bc")
@pytest.mark.skipif("CANOPENDEMO" not in os.environ, reason="CANOPENDEMO names no checkout of CANopenDemo")
def test_the_bats_suite_of_canopendemo(
    gateway: Callable[..., str], suite: str, turn: str, tmp_path: Path
) -> None:
    """As it is, on our drive: its node id, its domain object and the gateway's id are other ones."""
    del turn
    gateway("set node 1")
    copy = tmp_path / "running_canopen"
    shutil.copytree(Path(os.environ["CANOPENDEMO"]) / "test" / "running_canopen", copy)
    (tmp_path / "libs").mkdir()
    for library in ("bats-assert", "bats-support"):
        (tmp_path / "libs" / library).symlink_to(BATS_LIBRARIES / library)
    file = copy / f"{suite}.bats"
    file.write_text(file.read_text(encoding="utf-8").replace(DOMAIN_OF_DEMO, DOMAIN_OF_DRIVE))
    environment = {
        **os.environ,
        "test_can_device": INTERFACE,
        "cocomm_socket": str(tmp_path / "command"),
        "D1": f"{GATEWAY:02X}",
        "B1": f"{0x80 + GATEWAY:02X}",
        "D2": f"{DRIVE:02X}",
        "B2": f"{0x80 + DRIVE:02X}",
    }
    result = run("bats", file.name, cwd=copy, env=environment)
    assert result.returncode == 0, result.stdout


@TWICE
@pytest.mark.parametrize("eds", sorted(EDS.glob("*.eds")), ids=lambda path: path.name)
@installed("dcfchk")
def test_lely_finds_nothing_in_an_eds_file(eds: Path, turn: str) -> None:
    del turn
    result = run("dcfchk", "-n", "5", str(eds))
    assert (result.returncode, result.stdout + result.stderr) == (0, "")


@TWICE
@installed("dcfgen")
def test_a_concise_dcf_of_lely_is_read(tmp_path: Path, turn: str) -> None:
    del turn
    (tmp_path / "bus.yml").write_text(
        f"master:\n  node_id: 127\nx:\n  dcf: {EDS / 'servo_drive.eds'}\n  node_id: 1\n"
        "  heartbeat_producer: 100\n  sdo:\n    - {index: 0x6065, sub_index: 0, value: 4242}\n"
    )
    result = run("dcfgen", "-d", str(tmp_path), "bus.yml", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    entries = read_concise_dcf(tmp_path / "x.bin")
    assert (0x6065, 0, (4242).to_bytes(4, "little")) in [(e.index, e.subindex, e.data) for e in entries]


def coctl(folder: Path, *commands: str) -> list[str]:
    """What Lely's master answers to each command, its number cut off."""
    result = subprocess.run(
        ["coctl", "-i", "200", INTERFACE, str(folder / "master.dcf")],
        input="".join(f"{command}\n" for command in commands),
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
        cwd=folder,
    )
    lines = [line for line in result.stdout.splitlines() if line.startswith("[")]
    return [line.split("]", 1)[1].strip() for line in lines]


@TWICE
@installed("coctl", "dcfgen")
def test_lely_masters_the_drive_by_a_dcf_of_its_generator(simulator: None, tmp_path: Path, turn: str) -> None:
    """`init` starts its NMT service: before that it is no master yet, and every node is unsupported."""
    del simulator, turn
    (tmp_path / "bus.yml").write_text(
        f"master:\n  node_id: 127\nx:\n  dcf: {EDS / 'servo_drive.eds'}\n  node_id: {DRIVE}\n"
        "  mandatory: true\n  heartbeat_producer: 100\n"
    )
    assert run("dcfgen", "-d", str(tmp_path), "bus.yml", cwd=tmp_path).returncode == 0
    answers = {
        f"{DRIVE} read 0x1000 0 u32": "ERROR: 107 (Unsupported node)",
        "init 0": "OK",
        f"{DRIVE} read 0x1000  0 u32": "0x00020192",
        f"{DRIVE} write 0x6065 0 u32 4242": "OK",
        f"{DRIVE} read 0x6065 0 u32": "0x00001092",
        f"{DRIVE} read 0x5FFF 0 u32": "ERROR: 06020000 (Object does not exist in the object dictionary)",
        f"{DRIVE} preop": "OK",
        "lss_switch_sel 0xFFFE 0x402 0x10000 0x10001": "OK",
        "lss_get_node": f"{DRIVE}",
        "lss_conf_bitrate 0 2": "OK",
        "lss_conf_bitrate 0 8": "ERROR: 503 (LSS bit-rate not supported)",
        "lss_switch_glob 0": "OK",
    }
    assert coctl(tmp_path, "set network 1", *answers) == ["OK", *answers.values()]


@TWICE
@installed("cangen", "tshark", "candump")
def test_wireshark_reads_every_frame_also_under_a_flood(simulator: None, tmp_path: Path, turn: str) -> None:
    """The suite of ours in front of a generator of frames that nobody uses."""
    del simulator, turn
    capture = tmp_path / "frames.pcap"
    tshark = ["tshark", "-i", INTERFACE, "-w", str(capture), "-a", "duration:600"]
    with subprocess.Popen(tshark, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as recorder:
        assert recorder.stderr is not None
        while "Capturing" not in recorder.stderr.readline():
            pass
        with subprocess.Popen(["cangen", INTERFACE, "-I", "6F0", "-g", "2", "-n", "2000"]) as generator:
            suite = conformance(DRIVE, EDS / "servo_drive.eds")
            generator.wait(LIMIT_S)
        recorder.terminate()
    assert suite.returncode == 0, suite.stdout
    # an NMT message of one byte is one of the suite's questions
    fields = ("frame.number", "can.id", "can.len", "_ws.malformed")
    shown = [word for field in fields for word in ("-e", field)]
    read = run("tshark", "-r", str(capture), "-d", "can.subdissector,canopen", "-T", "fields", *shown)
    lines = read.stdout.splitlines()
    assert len(lines) > 2000
    malformed = [line.split("\t") for line in lines if "Malformed" in line]
    assert not [line for line in malformed if line[1:3] != ["0", "1"]]


def conformance(node: int, eds: Path) -> subprocess.CompletedProcess[str]:
    """`servo-ctrl conformance`."""
    program = str(Path(sys.executable).with_name("servo-ctrl"))
    return run(program, "conformance", "--bus", BUS, "--node", str(node), "--eds", str(eds))


@TWICE
@installed("demoLinuxDevice")
@pytest.mark.skipif("CANOPENDEMO" not in os.environ, reason="CANOPENDEMO names no checkout of CANopenDemo")
def test_our_suite_agrees_with_the_demo_device(tmp_path: Path, turn: str) -> None:
    """A node of others, which has passed CiA's own test tool: our suite finds nothing to complain about."""
    del turn
    with (
        demo_device(tmp_path),
        canopen.Network().connect(interface="socketcan", channel=INTERFACE) as network,
    ):
        network.add_node(DEMO, canopen.ObjectDictionary()).sdo.download(0x1010, 1, b"save")
    with demo_device(tmp_path):
        eds = Path(os.environ["CANOPENDEMO"]) / "demo" / "demoDevice.eds"
        result = conformance(DEMO, eds)
    assert result.returncode == 0, result.stdout
    assert "0 fail" in result.stdout.splitlines()[-1]


@contextlib.contextmanager
def demo_device(folder: Path) -> Iterator[None]:
    """CANopenDemo's device on the bus, ended with the block."""
    command = ["demoLinuxDevice", INTERFACE, "-i", str(DEMO), "-s", f"{folder}/od_"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as device:
        try:
            time.sleep(1.0)
            yield
        finally:
            device.terminate()
