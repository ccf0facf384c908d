"""The section [mqtt] of a machine file, and the files it names."""

import re
from pathlib import Path

import pytest
from fake_command_handler import FakeCommandHandler
from machine_files import XY_TABLE, text_of, write_controller
from pydantic import ValidationError

from servo_ctrl.config.load import load_machine
from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.errors import ConfigError
from servo_ctrl.telemetry.mqtt.service import MqttLink

TABLE = XY_TABLE / "controller.toml"


def machine_with(section: str, folder: Path) -> Path:
    return write_controller(folder, f"{text_of(TABLE)}\n{section}")


def link(config: MqttConfig) -> MqttLink:
    return MqttLink(config, "xy_table", FakeCommandHandler())


def test_a_machine_has_no_mqtt_unless_it_asks_for_it(tmp_path: Path) -> None:
    assert load_machine(TABLE).mqtt is None
    machine = load_machine(machine_with("[mqtt]", tmp_path))
    assert machine.mqtt == MqttConfig(host="127.0.0.1", port=1883, prefix="servo_ctrl")


def test_the_files_of_the_section_are_relative_to_the_machine_file(tmp_path: Path) -> None:
    section = '[mqtt]\nusername = "table"\npassword_file = "broker.password"'
    machine = load_machine(machine_with(section, tmp_path))
    assert machine.mqtt is not None
    assert machine.mqtt.password_file == tmp_path / "broker.password"


@pytest.mark.parametrize(
    ("section", "reason"),
    [
        ('host = "a b"', "mqtt.host"),
        ("port = 0", "mqtt.port"),
        ("port = 65536", "mqtt.port"),
        ('prefix = ""', "mqtt.prefix"),
        ('prefix = "/a"', "mqtt.prefix"),
        ('prefix = "a/"', "mqtt.prefix"),
        ('prefix = "a/#"', "mqtt.prefix"),
        ('prefix = "$SYS"', "mqtt.prefix"),
        ('client_id = "a b"', "mqtt.client_id"),
        ("keepalive_s = 0", "mqtt.keepalive_s"),
        ('password = "secret"', "mqtt.password: unknown key"),
        ('password_file = "a"', "mqtt.password_file: needs username"),
        ('ca_file = "a"', "mqtt.ca_file: needs tls = true"),
        ('tls = true\ncert_file = "a"', "mqtt.cert_file: certificate and key_file belong together"),
    ],
)
def test_inconsistent_values_are_refused(section: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as refused:
        load_machine(machine_with(f"[mqtt]\n{section}", tmp_path))
    assert reason in str(refused.value)


@pytest.mark.parametrize(
    ("address", "host", "port"),
    [
        ("broker", "broker", 1883),
        ("broker.example:8883", "broker.example", 8883),
        ("192.0.2.7:1", "192.0.2.7", 1),
        ("[::1]:1884", "::1", 1884),
        ("[::1]", "::1", 1883),
    ],
)
def test_the_address_of_the_command_line_is_parsed(address: str, host: str, port: int) -> None:
    assert MqttConfig().at(address) == MqttConfig(host=host, port=port)


def test_another_address_leaves_login_and_encryption_as_they_are() -> None:
    configured = MqttConfig(
        host="plant", port=8883, prefix="hall/3", username="table", password_file=Path("secret"), tls=True
    )
    assert configured.at("desk") == configured.model_copy(update={"host": "desk"})
    assert configured.at("desk:18883") == configured.model_copy(update={"host": "desk", "port": 18883})


@pytest.mark.parametrize("address", ["", ":1883", "a:b", "a:0", "a:99999", "a b", "::1", "a:1:2", "[::1"])
def test_a_bad_address_is_refused_in_one_line(address: str) -> None:
    with pytest.raises(ValueError, match=re.escape(repr(address))) as refused:
        MqttConfig().at(address)
    assert not isinstance(refused.value, ValidationError)
    assert "\n" not in str(refused.value)


def test_an_unusable_password_file_is_reported_before_anything_moves(tmp_path: Path) -> None:
    file = tmp_path / "password"
    config = MqttConfig(username="table", password_file=file)
    with pytest.raises(ConfigError, match="no such file"):
        link(config)
    file.touch(0o644)
    with pytest.raises(ConfigError, match=r"others may read it \(mode 644\); chmod 600 it"):
        link(config)
    file.chmod(0o600)
    for content in (b"", b"\n", b"x" * 2000):
        file.write_bytes(content)
        with pytest.raises(ConfigError, match="its first line is not a password"):
            link(config)
    file.write_bytes(b"\xff")
    with pytest.raises(ConfigError, match="cannot be read"):
        link(config)
    file.write_bytes(b"secret\r\nmore\n")
    assert link(config).problem == "not connected yet"


def test_unusable_certificates_are_reported_before_anything_moves(tmp_path: Path) -> None:
    file = tmp_path / "cert.pem"
    file.write_text("no certificate")
    with pytest.raises(ConfigError, match=r"cert\.pem: no readable certificates"):
        link(MqttConfig(tls=True, ca_file=file))
    file.chmod(0o644)
    with pytest.raises(ConfigError, match=r"cert\.pem: others may read it"):
        link(MqttConfig(tls=True, cert_file=file, key_file=file))
    file.chmod(0o600)
    with pytest.raises(ConfigError, match=r"cert\.pem: no certificate with its key"):
        link(MqttConfig(tls=True, cert_file=file, key_file=file))
