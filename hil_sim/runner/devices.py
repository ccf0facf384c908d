"""Makes drives, scales and fault targets of a machine from its plant file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hil_sim.config import ConfigError, Plant, PlantConfig
from hil_sim.drive.amplifier_device import Drive
from hil_sim.drive.family_drive import FamilyDrive
from hil_sim.faults.fault_target import FaultTarget
from hil_sim.node.node_host import NodeHost
from hil_sim.node.storage import StoredParametersError
from hil_sim.scale.encoder_device import LinearScale

Device = Drive | LinearScale


def make_devices(
    config: PlantConfig, plant: Plant, host: NodeHost
) -> tuple[list[Device], dict[str, FaultTarget]]:
    """Make all devices, axis by axis, and the target of faults of each axis. Raises ConfigError."""
    devices: list[Device] = []
    targets: dict[str, FaultTarget] = {}
    for index, (name, axis) in enumerate(config.axes.items()):
        with _eds_of(axis.drive.eds, f"axis.{name}.drive.eds"):
            arguments = axis, plant, index, host
            personality = axis.drive.personality
            drive = Drive(*arguments) if personality is None else FamilyDrive(personality, *arguments)
        devices.append(drive)
        scale = None
        if axis.scale is not None:
            with _eds_of(axis.scale.eds, f"axis.{name}.scale.eds"):
                scale = LinearScale(axis, plant, index, host)
            devices.append(scale)
        targets[name] = FaultTarget(name, drive, scale, plant.params[index], plant.state[index])
    return devices, targets


@contextmanager
def _eds_of(eds: Path, key: str) -> Iterator[None]:
    """Raise any error of a device's EDS file or stored parameters as ConfigError."""
    try:
        yield
    except StoredParametersError as error:
        raise ConfigError(error.file, "", f"stored parameters: {error.reason}") from error
    except OSError as error:
        raise ConfigError(eds, key, error.strerror or "cannot be read") from error
    except Exception as error:  # canopen's importer raises various errors for a broken file
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ConfigError(eds, key, f"no usable EDS of this device: {reason}") from error
