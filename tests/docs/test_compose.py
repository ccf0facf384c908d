"""docker-compose.yml holds to the Compose Specification, and everything it names is there.

Its commands are run as they are by tests/vcan/test_compose_commands.py.
"""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer.main
import yaml
from command_parsing import PROGRAMS, parse

ROOT = Path(__file__).resolve().parents[2]
COMPOSE = ROOT / "docker-compose.yml"


def services() -> dict[str, Any]:
    document = yaml.safe_load(COMPOSE.read_text())
    return dict(document["services"])


def check_schema(path: Path) -> subprocess.CompletedProcess[str]:
    """check-jsonschema carries the schema of the specification's own repository."""
    command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize("file", [COMPOSE, ROOT / "deploy" / "compose.page.yml"], ids=lambda file: file.name)
def test_it_holds_to_the_compose_specification(file: Path) -> None:
    result = check_schema(file)
    assert result.returncode == 0, result.stdout + result.stderr


def test_the_schema_detects_a_mistake(tmp_path: Path) -> None:
    wrong = tmp_path / "docker-compose.yml"
    wrong.write_text(COMPOSE.read_text().replace("network_mode", "network_moed"))
    result = check_schema(wrong)
    assert result.returncode == 1
    assert "network_moed" in result.stdout


def test_every_service_of_the_bench_is_on_the_hosts_network() -> None:
    bench = {name: service for name, service in services().items() if "profiles" not in service}
    assert set(bench) == {"vcan", "hil-sim", "servo-ctrl", "mosquitto"}
    assert {service["network_mode"] for service in bench.values()} == {"host"}


def test_the_history_is_kept_only_on_request_and_visible_on_this_host_alone() -> None:
    history = {name: service for name, service in services().items() if "profiles" in service}
    assert set(history) == {"influxdb", "telegraf", "grafana"}
    assert [service["profiles"] for service in history.values()] == [["history"]] * 3
    ports = [port for service in history.values() for port in service.get("ports", ())]
    assert len(ports) == 2
    assert all(port.startswith("127.0.0.1:") for port in ports)


def test_every_image_of_others_is_pinned() -> None:
    images = [service["image"] for service in services().values() if "build" not in service]
    assert len(images) == 4
    assert all(re.fullmatch(r"[a-z/-]+:[0-9]+\.[0-9]+\.[0-9]+", image) for image in images)


def test_no_secret_is_in_the_file_and_the_script_draws_them_once(tmp_path: Path) -> None:
    names = {"DOCKER_INFLUXDB_INIT_PASSWORD", "DOCKER_INFLUXDB_INIT_ADMIN_TOKEN", "INFLUX_TOKEN"}
    names.add("GF_SECURITY_ADMIN_PASSWORD")
    assert not [name for name in names if name in COMPOSE.read_text()]
    script = tmp_path / "deploy" / "history" / "make_env.sh"
    script.parent.mkdir(parents=True)
    shutil.copy(ROOT / "deploy" / "history" / "make_env.sh", script)
    first = subprocess.run(["sh", script], capture_output=True, text=True, check=True, timeout=20)
    made = tmp_path / "history.env"
    drawn = dict(line.split("=") for line in made.read_text().splitlines())
    assert set(drawn) == names
    assert min(map(len, drawn.values())) == 48
    assert len(set(drawn.values())) == 3  # Telegraf and Grafana have the token that InfluxDB gets
    assert made.stat().st_mode & 0o777 == 0o600
    assert not [value for value in drawn.values() if value in first.stdout]
    before = made.read_bytes()
    assert subprocess.run(["sh", script], capture_output=True, check=False, timeout=20).returncode == 1
    assert made.read_bytes() == before


@pytest.mark.parametrize("name", ["hil-sim", "servo-ctrl", "mosquitto", "influxdb", "telegraf", "grafana"])
def test_every_lasting_service_has_a_health_check(name: str) -> None:
    assert services()[name]["healthcheck"]["test"][0] == "CMD"


def test_a_service_waits_for_what_it_needs() -> None:
    conditions = {
        name: {other: how["condition"] for other, how in service.get("depends_on", {}).items()}
        for name, service in services().items()
    }
    assert conditions["hil-sim"] == {"vcan": "service_completed_successfully"}
    assert conditions["telegraf"] == {"influxdb": "service_healthy", "mosquitto": "service_healthy"}
    assert conditions["grafana"] == {"influxdb": "service_healthy"}
    assert conditions["servo-ctrl"] == {"hil-sim": "service_healthy", "mosquitto": "service_healthy"}


@pytest.mark.parametrize("name", ["hil-sim", "servo-ctrl"])
def test_a_program_writes_to_its_volumes_alone_and_is_not_root(name: str) -> None:
    service = services()[name]
    image = (ROOT / service["build"]["dockerfile"]).read_text(encoding="utf-8")
    assert service["read_only"] is True
    assert "user" not in service
    assert re.findall(r"^USER (.*)$", image, flags=re.MULTILINE) == ["servo"]
    volumes = dict(volume.split(":") for volume in service["volumes"])
    variables = dict(
        word.split("=") for line in re.findall(r"^ENV (.*)$", image, re.MULTILINE) for word in line.split()
    )
    written = {variables["NUMBA_CACHE_DIR"], variables["XDG_STATE_HOME"], "/run/servo"}
    assert written == set(volumes.values())
    (made,) = re.findall(r"install --directory --owner=servo (.*)$", image, re.MULTILINE)
    assert written == set(made.split())
    assert f"{variables['MPLCONFIGDIR']}" in service["tmpfs"]


def test_what_the_image_copies_is_not_ignored_and_secrets_are() -> None:
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    image = (ROOT / "deploy" / "Dockerfile").read_text(encoding="utf-8")
    copied = {word for line in re.findall(r"^COPY (.*) \S+$", image, re.MULTILINE) for word in line.split()}
    assert {f"!{source}" for source in copied} <= set(ignored)
    assert ignored.index("*") < ignored.index("**/*.env")


def test_every_path_in_the_commands_exists() -> None:
    for service in services().values():
        words = [*shlex.split(service.get("command", "")), *service.get("healthcheck", {}).get("test", [])]
        words += [volume.split(":")[0].removeprefix("./") for volume in service.get("volumes", ())]
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
    rooms = {"kernels", "servo_ctrl", "hil_sim", "local_can", "can_frames", "reconcile"}
    assert rooms | {"eds", "machines", "deploy"} <= set(copied)
    for source in copied:
        assert (ROOT / source).exists(), source


def commands_of_the_image() -> list[str]:
    """Our commands in both compose files, by the default bus and by localcan, and in the Dockerfile."""
    found = []
    for file in (COMPOSE, ROOT / "deploy" / "compose.page.yml"):
        for service in yaml.safe_load(file.read_text(encoding="utf-8"))["services"].values():
            command = service.get("command", "")
            found += [
                re.sub(r"\$\{\w+:-([^}]*)\}", bus, command)
                for bus in (r"\1", "localcan:/run/servo/table.sock")
            ]
    recipe = (ROOT / "deploy" / "Dockerfile").read_text(encoding="utf-8")
    for line in re.findall(r"^RUN (.*)$", recipe, re.MULTILINE):
        found += line.split(" && ")
    return [command for command in found if command.partition(" ")[0] in PROGRAMS]


@pytest.mark.parametrize("command", commands_of_the_image())
def test_a_command_of_the_image_is_one_that_its_program_takes(
    command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    parse(shlex.split(command))


def test_the_image_runs_both_programs_and_a_wrong_option_is_refused() -> None:
    commands = commands_of_the_image()
    assert {" ".join(command.split()[:2]) for command in commands} == {
        "hil-sim run", "hil-sim compile", "servo-ctrl run", "servo-ctrl compile",
    }  # fmt: skip
    with pytest.raises(typer._click.exceptions.UsageError):
        parse(shlex.split(commands[0].replace("--bus", "--buss")))
