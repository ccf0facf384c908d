"""A proposal as sections of the machine file, put into a machine in memory or into the text of its file."""

import hashlib
import re
from pathlib import Path
from typing import Any

from servo_ctrl.config.contour import contour_objection
from servo_ctrl.config.law_sections import SECTION_TYPES
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.plant_model import MeasuredPlant
from servo_ctrl.config.plant_of_axis import section_of
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.modal_model import ModalModel
from servo_ctrl.excitation.measuring_motion import TuneError
from servo_ctrl.files.toml_text import toml_text
from servo_ctrl.files.whole_file import write_text_whole, write_whole
from servo_ctrl.tuning.proposal import NotchValues, Proposal

MEASURED_PLANT = "measured_plant"
"""The section of an axis with its measured plant."""
Sections = dict[str, dict[str, Any]]
"""Section of an axis -> key -> value."""


def sections_of(proposal: Proposal, model: ModalModel, *, has_notch: bool) -> Sections:
    """Return the sections of a proposal for a measured plant.

    A notch that only the machine file has is switched off.
    """
    sections: Sections = {
        "control": {
            "kp_1_s": proposal.kp_1_s,
            "kv_n_s_m": proposal.kv_n_s_m,
            "ki_n_m": proposal.ki_n_m,
            "velocity_feedforward": proposal.velocity_feedforward,
            "acceleration_feedforward_kg": proposal.acceleration_feedforward_kg,
        }
    }
    if proposal.notch is not None:
        sections[notch.SECTION.name] = {"enabled": True, **proposal.notch._asdict()}
    elif has_notch:
        sections[notch.SECTION.name] = {"enabled": False}
    sections[MEASURED_PLANT] = section_of(model).model_dump()
    return sections


def with_sections(machine: MachineConfig, axis: str, sections: Sections) -> MachineConfig:
    """Return the machine with these values on one axis."""
    config = machine.axes[axis]
    update: dict[str, Any] = {"control": config.control.model_copy(update=sections["control"])}
    name = notch.SECTION.name
    if name in sections:
        present = getattr(config, name)
        keys = {} if present is None else {key: getattr(present, key) for key in NotchValues._fields}
        update[name] = SECTION_TYPES[name](**(keys | sections[name]))
    if MEASURED_PLANT in sections:
        update[MEASURED_PLANT] = MeasuredPlant(**sections[MEASURED_PLANT])
    return machine.model_copy(update={"axes": {**machine.axes, axis: config.model_copy(update=update)}})


def section_text(axis: str, sections: Sections) -> str:
    """Return the sections as text of a machine file."""
    return "\n".join(f"[axis.{axis}.{name}]\n{_lines(values)}" for name, values in sections.items())


def _lines(values: dict[str, Any]) -> str:
    """Return one line per key: a list of numbers too, so that a key can be replaced by its line."""
    return "".join(
        f"{key} = [{', '.join(map(repr, value))}]\n" if isinstance(value, tuple) else toml_text({key: value})
        for key, value in values.items()
    )


def with_values(text: str, axis: str, sections: Sections) -> str:
    """Return the text of a machine file with these values; everything else is unchanged, comments too."""
    for name, values in sections.items():
        header = f"[axis.{axis}.{name}]"
        lines = text.split("\n")
        try:
            first = next(k for k, line in enumerate(lines) if line.split("#")[0].strip() == header)
        except StopIteration:
            text = text.rstrip("\n") + f"\n\n{header}\n{_lines(values)}"
            continue
        end = next((k for k in range(first + 1, len(lines)) if lines[k].lstrip().startswith("[")), len(lines))
        while end > first + 1 and not lines[end - 1].strip():
            end -= 1
        body = lines[first + 1 : end]
        for key, value in values.items():
            written = _lines({key: value}).strip()
            index = next((k for k, line in enumerate(body) if re.match(rf"\s*{key}\s*=", line)), None)
            if index is None:
                body.append(written)
            else:
                _, hash_, comment = body[index].partition("#")
                body[index] = f"{written}  # {comment.strip()}" if hash_ else written
        text = "\n".join([*lines[: first + 1], *body, *lines[end:]])
    return text


def digest_of(file: Path) -> str:
    """Return the SHA-256 of a machine file; "" where it cannot be read any more."""
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError:
        return ""


def check_unchanged(machine: MachineConfig) -> None:
    """Raise TuneError unless the machine file is still the one that was read."""
    if digest_of(machine.source) != machine.source_sha256:
        raise TuneError(
            f"{machine.source} was changed while the axis was tuned, and what was measured belongs to the "
            "file as it was: tune again"
        )


def apply_to_file(machine: MachineConfig, axis: str, sections: Sections) -> Path:
    """Put the values into the machine file, and return the path of the copy of the file as it was.

    Raises TuneError where the file was changed since it was read, where such a copy exists already, or where
    the file with the values would be refused.
    """
    file = machine.source
    check_unchanged(machine)
    if objection := contour_objection(with_sections(machine, axis, sections)):
        raise TuneError(
            f"{file} stays as it was: with the proposed values it would be refused, "
            f"contour_control.{objection}; lower that gain or switch the section off, then tune again"
        )
    content = file.read_bytes()
    kept = file.with_name(f"{file.name}.before-tune")
    if kept.exists():
        raise TuneError(f"{kept} exists already, from an earlier tuning; move it away first")
    write_whole(kept, lambda copy: copy.write_bytes(content))
    text = content.decode("utf-8")
    line_end = "\r\n" if "\r\n" in text else "\n"
    changed = with_values(text.replace("\r\n", "\n"), axis, sections)
    write_text_whole(file, changed.replace("\n", line_end))
    return kept
