"""Reads password and certificates for the MQTT broker before anything moves."""

import ssl
from pathlib import Path

from servo_ctrl.config.mqtt_model import MqttConfig
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.private_file import refuse_readable_for_others

PASSWORD_LIMIT = 1024
"""Bounds the characters of a password; chosen."""


def password_in(path: Path) -> str:
    """Return the first line of a file that only its owner may read. Raises ConfigError."""
    refuse_readable_for_others(path)
    try:
        with path.open(encoding="utf-8") as file:
            line = file.readline(PASSWORD_LIMIT + 1).rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(path, "", f"cannot be read: {type(error).__name__}") from None
    if not 1 <= len(line) <= PASSWORD_LIMIT:
        raise ConfigError(path, "", f"its first line is not a password of 1 to {PASSWORD_LIMIT} characters")
    return line


def tls_context(config: MqttConfig) -> ssl.SSLContext:
    """Make the TLS context: trusted authorities and our certificate. Raises ConfigError.

    Call it once, because reading the system's certificates takes longer than a cycle.
    """
    try:
        context = ssl.create_default_context(cafile=config.ca_file)
    except (OSError, ssl.SSLError) as error:
        raise ConfigError(config.ca_file or "", "", f"no readable certificates: {error}") from None
    if config.cert_file is not None and config.key_file is not None:
        refuse_readable_for_others(config.key_file)
        try:
            context.load_cert_chain(config.cert_file, config.key_file, password=_no_passphrase)
        except (OSError, ssl.SSLError, ValueError) as error:
            raise ConfigError(config.cert_file, "", f"no certificate with its key: {error}") from None
    return context


def _no_passphrase() -> str:
    """Refuse an encrypted key, for which OpenSSL would otherwise ask a passphrase on the terminal."""
    raise ValueError("the key is encrypted")
