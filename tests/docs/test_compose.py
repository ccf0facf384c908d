"""docker-compose.yml holds to the Compose Specification, and everything it names is there.

Its commands are run as they are by tests/vcan/test_compose_commands.py.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
COMPOSE = ROOT / "docker-compose.yml"


def services() -> dict[str, Any]:
    document = yaml.safe_load(COMPOSE.read_text())
    return dict(document["services"])


def check_schema(path: Path) -> subprocess.CompletedProcess[str]:
    """check-jsonschema carries the schema of the specification's own repository."""
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def test_it_holds_to_the_compose_specification() -> None:
    result = check_schema(COMPOSE)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_schema_would_notice_a_mistake(tmp_path: Path) -> None:
    wrong = tmp_path / "docker-compose.yml"
    wrong.write_text(COMPOSE.read_text().replace("network_mode", "network_moed"))
    result = check_schema(wrong)
    assert result.returncode == 1
    assert "network_moed" in result.stdout


def test_every_service_of_the_bench_is_on_the_hosts_network() -> None:
    assert set(services()) == {"vcan", "hil-sim", "servo-ctrl", "mosquitto"}
    assert {service["network_mode"] for service in services().values()} == {"host"}


@pytest.mark.parametrize("name", ["hil-sim", "servo-ctrl", "mosquitto"])
def test_every_lasting_service_has_a_health_check(name: str) -> None:
    assert services()[name]["healthcheck"]["test"][0] == "CMD"


def test_a_service_waits_for_what_it_needs() -> None:
    conditions = {
        name: {other: how["condition"] for other, how in service.get("depends_on", {}).items()}
        for name, service in services().items()
    }
    assert conditions["hil-sim"] == {"vcan": "service_completed_successfully"}
    assert conditions["servo-ctrl"] == {"hil-sim": "service_healthy", "mosquitto": "service_healthy"}


def test_every_path_in_the_commands_exists() -> None:
    for service in services().values():
        words = [*shlex.split(service["command"]), *service.get("healthcheck", {}).get("test", [])]
        for word in words:
            if word.startswith(("deploy/", "machines/")):
                assert (ROOT / word).exists(), word


def test_the_image_is_built_from_files_that_exist() -> None:
    dockerfile = ROOT / services()["hil-sim"]["build"]["dockerfile"]
    copied = []
    for line in dockerfile.read_text().splitlines():
        if line.startswith("COPY "):
            *sources, _ = line.split()[1:]
            copied += sources
    assert {"servo_ctrl", "hil_sim", "local_can", "reconcile", "eds", "machines", "deploy"} <= set(copied)
    for source in copied:
        assert (ROOT / source).exists(), source
