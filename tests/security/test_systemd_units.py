"""The units of deploy/systemd are confined: no privilege, few writable paths, few sockets."""

import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hil_sim.cli.main import app as hil_sim
from servo_ctrl.cli.main import app as servo_ctrl
from servo_ctrl.hmi.__main__ import cli as page

UNITS = Path(__file__).parents[2] / "deploy" / "systemd"
NAMES = ("hil-sim", "servo-ctrl", "servo-page")
FIFO = UNITS / "servo-ctrl.service.d" / "fifo.conf"
EXPOSURE_LIMIT = 20
"""Tenths of systemd's own figure: 100 is without any sandbox, 20 and less is "OK"."""
needs_systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed (package systemd)"
)
ALWAYS = {
    "NoNewPrivileges": "yes",
    "RestrictSUIDSGID": "yes",
    "LockPersonality": "yes",
    "ProtectSystem": "strict",
    "ProtectHome": "yes",
    "PrivateTmp": "yes",
    "PrivateDevices": "yes",
    "ProtectKernelTunables": "yes",
    "ProtectKernelModules": "yes",
    "ProtectKernelLogs": "yes",
    "ProtectControlGroups": "yes",
    "ProtectClock": "yes",
    "ProtectHostname": "yes",
    "ProtectProc": "invisible",
    "RestrictNamespaces": "yes",
    "SystemCallArchitectures": "native",
    "IPAddressDeny": "any",
    "UMask": "0077",
    "LimitCORE": "0",
}
FAMILIES = {
    "hil-sim": {"AF_CAN", "AF_UNIX"},
    "servo-ctrl": {"AF_CAN", "AF_UNIX", "AF_INET", "AF_INET6"},
    "servo-page": {"AF_UNIX", "AF_INET", "AF_INET6"},
}


def service(*files: Path) -> dict[str, list[str]]:
    """The values of each key of [Service], as systemd joins a unit with its drop-ins: an empty one clears."""
    found: dict[str, list[str]] = defaultdict(list)
    for file in files:
        section = ""
        for line in file.read_text(encoding="utf-8").splitlines():
            if line.startswith("["):
                section = line
            elif section == "[Service]" and line and not line.startswith("#"):
                key, _, value = line.partition("=")
                found[key] = [*found[key], value] if value else []
    return found


def unit(name: str) -> Path:
    return UNITS / f"{name}.service"


@pytest.mark.parametrize("name", NAMES)
def test_unit_has_no_privilege_and_writes_only_its_own_directories(name: str) -> None:
    keys = service(unit(name))
    assert {key: keys[key][-1:] for key in ALWAYS} == {key: [value] for key, value in ALWAYS.items()}
    text = unit(name).read_text()
    assert "\nCapabilityBoundingSet=\n" in text
    assert "\nAmbientCapabilities=\n" in text
    assert keys["RestrictRealtime"] == ["yes"]
    assert "ReadWritePaths" not in keys
    assert keys["SystemCallFilter"] == ["@system-service", "~@privileged"]
    assert keys.get("User") == ["servo"] or keys["DynamicUser"] == ["yes"]


@pytest.mark.parametrize("name", NAMES)
def test_unit_has_only_the_network_access_it_needs(name: str) -> None:
    (families,) = service(unit(name))["RestrictAddressFamilies"]
    assert set(families.split()) == FAMILIES[name]
    allowed = service(unit(name))["IPAddressAllow"]
    assert allowed == ([] if name == "hil-sim" else ["localhost"])


def test_fifo_gets_two_capabilities_and_nothing_else() -> None:
    plain, fifo = service(unit("servo-ctrl")), service(unit("servo-ctrl"), FIFO)
    changed = {key for key in plain | fifo if plain.get(key, []) != fifo.get(key, [])}
    assert changed == {"Environment", "CapabilityBoundingSet", "AmbientCapabilities", "RestrictRealtime"}
    for key in ("CapabilityBoundingSet", "AmbientCapabilities"):
        assert [set(value.split()) for value in fifo[key]] == [{"CAP_SYS_NICE", "CAP_IPC_LOCK"}]
    assert [entry for entry in fifo["Environment"] if entry not in plain["Environment"]] == [
        "SERVO_OPTIONS=--fifo"
    ]


def test_a_failed_controller_is_not_restarted() -> None:
    assert service(unit("servo-ctrl"))["Restart"] == ["no"]


@pytest.mark.parametrize("name", NAMES)
def test_every_option_of_a_command_line_exists(name: str) -> None:
    (line,) = service(unit(name))["ExecStart"]
    app, command = {"hil-sim": (hil_sim, "run"), "servo-ctrl": (servo_ctrl, "run")}.get(name, (page, "serve"))
    assert f" {command} " in line
    help_text = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200", "NO_COLOR": "1"}).stdout
    options = set(re.findall(r" (--[a-z-]+)", line)) | ({"--fifo"} if name == "servo-ctrl" else set())
    assert options <= set(re.findall(r"--[a-z-]+", help_text))


@needs_systemd
@pytest.mark.parametrize("name", NAMES)
def test_systemd_finds_nothing_wrong_and_little_exposed(name: str, tmp_path: Path) -> None:
    copied = tmp_path / unit(name).name
    text = unit(name).read_text()
    program = re.search(r"^ExecStart=(\S+)", text, re.MULTILINE)
    assert program is not None
    copied.write_text(text.replace(program[1], sys.executable))  # a file that is there
    if name == "servo-ctrl":
        shutil.copytree(FIFO.parent, tmp_path / FIFO.parent.name)
    verified = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", copied],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (verified.returncode, verified.stderr) == (0, "")
    rated = subprocess.run(
        [
            "systemd-analyze",
            "security",
            "--offline=true",
            f"--threshold={EXPOSURE_LIMIT}",
            "--no-pager",
            unit(name),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert rated.returncode == 0, rated.stdout[-500:]
