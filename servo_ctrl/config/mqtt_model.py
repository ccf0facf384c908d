"""The schema of controller.toml: the MQTT broker for status and commands."""

import re
from pathlib import Path  # pydantic resolves the annotation when the class is made
from typing import Annotated, Self

from pydantic import Field, Strict, StringConstraints, ValidationError, field_validator, model_validator

from servo_ctrl.config.section import FileSection

Host = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9._:-]+$", max_length=253)]
# No wildcards, control characters or empty levels, and no leading "$", which marks the broker's own topics.
TopicPrefix = Annotated[
    str, StringConstraints(pattern=r"^[^$#+/\x00-\x1f][^#+/\x00-\x1f]*(/[^#+/\x00-\x1f]+)*$", max_length=128)
]
ClientId = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_.-]+$", max_length=64)]

_ADDRESS = re.compile(r"(\[(?P<bracketed>[^]]+)\]|(?P<plain>[^:]+))(:(?P<port>[0-9]{1,5}))?")


class MqttConfig(FileSection):
    """The MQTT broker; without the section there is no MQTT. Passwords are in separate files."""

    host: Host = "127.0.0.1"
    """Name or address of the broker."""
    port: Annotated[int, Strict(), Field(ge=1, le=0xFFFF)] = 1883
    """Its TCP port; 8883 is usual with TLS."""
    prefix: TopicPrefix = "servo_ctrl"
    """Topics begin with `prefix/machine/`."""
    client_id: ClientId | None = None
    """Client identifier, unique at the broker; without it "servo_ctrl-" and the machine's name."""
    keepalive_s: Annotated[int, Strict(), Field(ge=5, le=3600)] = 15
    """Keep-alive time, seconds: controller and broker treat a longer silence as a lost connection."""
    plain_command: bool = True
    """Whether the topic `command` also accepts commands and settings, whatever right they need."""
    stream: bool = False
    """Whether to send the recorded rows too, as binary messages of minima and maxima."""
    stream_hz: Annotated[float, Strict(), Field(ge=1.0, le=10_000.0)] = 100.0
    """Pairs of minimum and maximum per second of every channel; at most one a cycle."""
    username: Annotated[str, StringConstraints(min_length=1, max_length=128)] | None = None
    """Name to log in with."""
    password_file: Path | None = None
    """File (chmod 600) whose first line is the password, relative to this file; needs `username`."""
    tls: bool = False
    """Whether to encrypt the connection and check the broker's certificate against `host`."""
    ca_file: Path | None = None
    """Trusted certificates (PEM), relative to this file; without it those of the system."""
    cert_file: Path | None = None
    """Certificate of the controller (PEM), relative to this file, for a broker that requires one."""
    key_file: Path | None = None
    """The private key of `cert_file` (PEM, chmod 600), relative to this file."""

    @field_validator("host", mode="before")
    @classmethod
    def _no_login(cls, value: object) -> object:
        """Refuse a password in the host before the pattern's message would repeat it."""
        if isinstance(value, str) and "@" in value:
            raise ValueError("give it without user and password; those are username and password_file")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.password_file is not None and self.username is None:
            raise ValueError("password_file: needs username")
        for key in ("ca_file", "cert_file", "key_file"):
            if getattr(self, key) is not None and not self.tls:
                raise ValueError(f"{key}: needs tls = true")
        if (self.cert_file is None) != (self.key_file is None):
            raise ValueError("cert_file: certificate and key_file belong together")
        return self

    def at(self, address: str) -> Self:
        """Return this broker at another "HOST[:PORT]" or "[IPV6][:PORT]". Raises ValueError."""
        if "@" in address:
            raise ValueError("give HOST[:PORT] without user and password: [mqtt] username and password_file")
        found = _ADDRESS.fullmatch(address)
        if found is None:
            raise ValueError(f"{address!r} is not HOST[:PORT]")
        given = {"host": found["bracketed"] or found["plain"]}
        port = {} if found["port"] is None else {"port": int(found["port"])}
        try:
            return self.model_validate({**self.model_dump(), **given, **port})
        except ValidationError as error:
            detail = error.errors(include_url=False)[0]
            raise ValueError(f"{address!r}: {detail['loc'][0]}: {detail['msg'].lower()}") from None
