"""Lely's programs against the simulated nodes on vcan0, each twice in a row; `make conformance` runs this.

dcfchk, dcfgen        check of an EDS file, and the concise DCF of a network
coctl                 its master, with the DCF of dcfgen
"""

import subprocess
from pathlib import Path

import pytest
from public_programs import DRIVE, EDS, INTERFACE, LIMIT_S, TWICE, installed, run

from servo_ctrl.canopen.concise_dcf import read_concise_dcf

pytestmark = pytest.mark.vcan


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
    """`init` starts its NMT service: before that it is not a master yet, and every node is unsupported."""
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
