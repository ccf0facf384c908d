"""Certificates made by deploy/make_certificates.sh, and a broker that requires them."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from mosquitto import Mosquitto

DEPLOY = Path(__file__).parents[2] / "deploy"
USERS = ("controller", "operator", "engineer", "display", "watcher")
needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed")


def make_certificates(folder: Path, *users: str) -> Path:
    """Make certificates of an authority, a broker at 127.0.0.1 and these users; return their folder."""
    command = ["sh", DEPLOY / "make_certificates.sh", folder, "127.0.0.1", *users]
    subprocess.run(command, check=True, capture_output=True, timeout=30)
    return folder


def broker_with(certificates: Path, folder: Path) -> Mosquitto:
    """Return a broker with deploy/mosquitto_certificates.conf; its user `watcher` may read and write all."""
    rights = folder / "acl"
    rights.write_text((DEPLOY / "mosquitto.acl").read_text() + "\nuser watcher\ntopic readwrite #\n")
    example = (DEPLOY / "mosquitto_certificates.conf").read_text()
    kept = [
        line
        for line in example.splitlines()
        if not re.match(r"#|listener |persistence |log_dest |acl_file ", line)
    ]
    settings = "\n".join(kept).replace("/mosquitto/certs", str(certificates))
    return Mosquitto(folder, f"{settings}\nacl_file {rights}")


def login(certificates: Path, user: str) -> list[str]:
    """Return the options with which a command line client presents the certificate of a user."""
    return [
        *("--cafile", str(certificates / "ca.pem"), "--cert", str(certificates / f"{user}.pem")),
        *("--key", str(certificates / f"{user}.key")),
    ]


def keys_of(certificates: Path, user: str) -> dict[str, object]:
    """Return the keys of [mqtt] that name the certificate of a user."""
    return {
        "tls": True,
        "ca_file": certificates / "ca.pem",
        "cert_file": certificates / f"{user}.pem",
        "key_file": certificates / f"{user}.key",
    }
