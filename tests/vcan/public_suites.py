"""Public CANopen programs that are not ours, against the simulated nodes on vcan0, each twice in a row.

`make conformance` runs this in user-mode Linux. The programs are not part of the project: those that are not
on PATH are skipped with their names. CANOPENDEMO names a checkout of CANopenDemo, for its bats suite and the
description of its demo device.

    canopend, cocomm      CANopenLinux: gateway and its client
    demoLinuxDevice       CANopenDemo's device, the node that is not ours
    bats                  runs CANopenDemo/test; its libraries are Debian's bats-assert and bats-support
    cangen, tshark        can-utils, Wireshark

Those of Lely are in lely_suites.py.
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
from public_programs import BUS, DRIVE, EDS, INTERFACE, LIMIT_S, TWICE, installed, run

pytestmark = pytest.mark.vcan

GATEWAY, SCALE, DEMO = 0x20, 11, 4
BATS_LIBRARIES = Path("/usr/lib/bats")
DOMAIN_OF_DEMO, DOMAIN_OF_DRIVE = "0x2122", "0x2000"


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
