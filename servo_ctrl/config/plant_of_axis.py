"""The plant of an axis as its machine file knows it: measured, or the mass of the feedforward, rigid."""

from collections.abc import Sequence

from kernels.arrays import Array
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.plant_model import MeasuredPlant
from servo_ctrl.control.axis_loop import Plant, rigid_plant
from servo_ctrl.control.compensation.notch import NotchSettings
from servo_ctrl.control.loop_margins import all_frequencies_hz
from servo_ctrl.control.modal_model import ModalModel, StructuralMode, with_modes


def measured_model(machine: MachineConfig, name: str) -> ModalModel | None:
    """Return the measured response of an axis; None if the file lacks it."""
    measured = machine.axes[name].measured_plant
    if measured is None:
        return None
    columns = (
        measured.mode_hz,
        measured.mode_damping_ratio,
        measured.mode_motor_1_kg,
        measured.mode_scale_1_kg,
    )
    return ModalModel(
        period_s=machine.period_s,
        motor_1_kg=1.0 / measured.mass_kg,
        scale_1_kg=1.0 / measured.scale_mass_kg,
        friction_1_s=measured.friction_1_s,
        delay_s=measured.delay_ms * 1e-3,
        modes=tuple(StructuralMode(*row) for row in zip(*columns, strict=True)),
        error=0.0,
    )


def section_of(model: ModalModel) -> MeasuredPlant:
    """Return a measured response as the section of the machine file."""
    hz, damping, motor, scale = (tuple(_rounded(mode[k]) for mode in model.modes) for k in range(4))
    return MeasuredPlant(
        mass_kg=_rounded(1.0 / model.motor_1_kg),
        scale_mass_kg=_rounded(1.0 / model.scale_1_kg),
        friction_1_s=_rounded(model.friction_1_s),
        delay_ms=_rounded(model.delay_s * 1e3),
        mode_hz=hz,
        mode_damping_ratio=damping,
        mode_motor_1_kg=motor,
        mode_scale_1_kg=scale,
    )


def frequencies_hz(machine: MachineConfig, names: Sequence[str]) -> Array:
    """Return ascending frequencies up to half the SYNC rate, dense around the modes of these axes, (n,)."""
    models = [model for model in (measured_model(machine, name) for name in names) if model is not None]
    return with_modes(all_frequencies_hz(machine.period_s), models)


def plant_of_axis(machine: MachineConfig, name: str, frequency_hz: Array) -> Plant:
    """Return the plant: measured, or the mass of the feedforward with one period until a set point acts."""
    control, model = machine.axes[name].control, measured_model(machine, name)
    if model is None:
        return rigid_plant(machine.period_s, control.acceleration_feedforward_kg, frequency_hz)
    return model.plant(frequency_hz, scale_feedback=control.feedback == "scale")


def unused_structures(machine: MachineConfig, name: str) -> list[str]:
    """Return the sections of an axis that name a structure which `plant_of_axis` does not have."""
    axis = machine.axes[name]
    if axis.measured_plant is not None:
        return []
    found, notch = [], axis.section(NotchSettings)
    if axis.input_shaper is not None:
        found.append(f"{axis.input_shaper.frequency_hz:g} Hz of axis {name} (input_shaper)")
    if notch is not None and notch.enabled:
        found.append(f"{notch.frequency_hz:g} Hz of axis {name} (notch)")
    return found


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")
