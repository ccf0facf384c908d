"""The files that a tuning writes: report.html, tuned.toml, tune.json, bode.json."""

import json
import math
from pathlib import Path
from typing import Any

from servo_ctrl.control.modal_model import antiresonances
from servo_ctrl.files.tuning_files import BODE_FILE, FIGURES_FILE, MACHINE_SECTIONS_FILE, REPORT_FILE
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.report.html_page import page
from servo_ctrl.tuning.curves import document_of
from servo_ctrl.tuning.machine_file import MEASURED_PLANT, section_text
from servo_ctrl.tuning.pictures import report_of
from servo_ctrl.tuning.results import AssessedSetting, TuneResult
from servo_ctrl.tuning.summary import summary_lines


def write_files(result: TuneResult, out: Path) -> list[Path]:
    """Write the files into `out`, and return their paths. Raises OSError."""
    out.mkdir(parents=True, exist_ok=True)
    comments = "".join(f"# {line}\n" for line in summary_lines(result))
    texts = {
        REPORT_FILE: page(report_of(result)),
        MACHINE_SECTIONS_FILE: comments + section_text(result.axis, result.sections) + _shaper_text(result),
        FIGURES_FILE: json.dumps(figures_of(result), indent=2, allow_nan=False) + "\n",
        BODE_FILE: json.dumps(document_of(result), allow_nan=False) + "\n",
    }
    for name, text in texts.items():
        write_text_whole(out / name, text)
    return [out / name for name in texts]


def _shaper_text(result: TuneResult) -> str:
    """Return the section of the reported input shaper, as comments of TOML."""
    shaper = result.proposal.shaper
    if shaper is None:
        return ""
    keys = "".join(f"# {key} = {value:g}\n" for key, value in shaper._asdict().items())
    head = "\n# Moves excite what rings while the motor is held. To be set on every axis of a path:\n"
    return f'{head}# [axis.{result.axis}.input_shaper]\n# kind = "zv"\n{keys}'


def figures_of(result: TuneResult) -> dict[str, Any]:
    """Return all figures in SI units, for JSON; None where a figure is missing or infinite."""
    model = result.model
    return {
        "machine": result.machine,
        "axis": result.axis,
        "stated_ms": result.ms,
        "measured_ms": result.measured_ms,
        "proved": result.proved,
        "simulated": result.simulated,
        "excitation_n": result.plan.amplitude_n,
        "speed_m_s": result.plan.speed_m_s,
        "plant": {
            "mass_kg": model.mass_kg,
            "delay_s": model.delay_s + model.period_s,
            "relative_error": model.error,
            "modes": [mode._asdict() for mode in model.modes],
        },
        "resonances": [
            {"frequency_hz": mode.frequency_hz, "damping_ratio": mode.damping_ratio}
            for mode in result.proposal.resonances
        ],
        "held": [{"frequency_hz": hz, "damping_ratio": damping} for hz, damping in antiresonances(model)],
        "proposed": {key: value for key, value in result.sections.items() if key != MEASURED_PLANT},
        "input_shaper": None if result.proposal.shaper is None else result.proposal.shaper._asdict(),
        "contour": None if result.proposal.contour is None else result.proposal.contour._asdict(),
        "before": _setting(result.before),
        "after": _setting(result.after),
        "notes": list(result.notes),
    }


def _setting(setting: AssessedSetting) -> dict[str, Any]:
    figures = {
        **setting.margins._asdict(),
        "compliance_m_n": setting.compliance_m_n,
        "remark": setting.remark,
    }
    trial = {} if setting.trial is None else setting.trial._asdict()
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in {**figures, **trial}.items()
    }
