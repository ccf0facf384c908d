"""The result of a tuning as lines of text, for the terminal and the report."""

import math
from collections.abc import Iterator

from servo_ctrl.control.modal_model import antiresonances
from servo_ctrl.tuning.results import AssessedSetting, TuneResult
from servo_ctrl.units import UM


def summary_lines(result: TuneResult) -> Iterator[str]:
    """Yield what was identified, proposed and verified."""
    model, proposal = result.model, result.proposal
    yield (
        f"axis {result.axis}: {model.mass_kg:.4g} kg, delay {1e3 * (model.delay_s + model.period_s):.2f} ms "
        f"from set point to position, model within {100.0 * model.error:.1f} % of the measured response"
    )
    for mode in proposal.resonances:
        yield f"  resonance {mode.frequency_hz:.2f} Hz, damping ratio {mode.damping_ratio:.4f}"
    if not proposal.resonances:
        yield "  no resonance stands out"
    for hz, damping in antiresonances(model):
        yield f"  while the motor is held, {hz:.2f} Hz rings with damping ratio {damping:.4f}"
    yield f"  before: {margins_line(result.before)}"
    measured = f"measured Ms {result.measured_ms:.2f}, stated {result.ms:g}"
    yield f"  after:  {margins_line(result.after)}; {measured}"
    if proposal.contour is not None:
        partner, is_measured, peak = proposal.contour
        plant = "measured plant of the machine file" if is_measured else "rigid mass"
        yield f"  with contour control: Ms {peak:.2f} of {result.axis} and {partner} ({partner}: {plant})"
    for name, before, after in trial_rows(result):
        yield f"  {name}: {before} -> {after}"
    if result.after.trial is not None and result.after.trial.hums:
        yield "  with the proposed values the axis oscillates at rest"


def margins_line(setting: AssessedSetting) -> str:
    """Return margins and stiffness of a setting."""
    margins = setting.margins
    if not margins.stable:
        return "not stable"
    gain = "" if math.isinf(margins.gain_margin_db) else f", gain margin {margins.gain_margin_db:.1f} dB"
    return (
        f"Ms {margins.sensitivity_peak:.2f} at {margins.peak_hz:.3g} Hz, phase margin "
        f"{margins.phase_margin_deg:.0f} deg{gain}, compliance {setting.compliance_m_n / UM:.3g} um/N at most"
    )


def trial_rows(result: TuneResult) -> list[tuple[str, str, str]]:
    """Return rows of indicator, value before and value after."""
    rows = []
    for name, field, unit, factor in INDICATORS:
        cells = []
        for setting in (result.before, result.after):
            value = math.nan if setting.trial is None else getattr(setting.trial, field)
            cells.append("-" if math.isnan(value) else f"{value * factor:.3g} {unit}")
        rows.append((name, cells[0], cells[1]))
    return rows


INDICATORS = (
    ("step of force, largest deviation", "step_peak_m", "um", 1e6),
    ("step of force, settled to a tenth", "step_settling_s", "ms", 1e3),
    ("move, largest deviation", "move_peak_m", "um", 1e6),
    ("move, settled after its end", "move_settling_s", "ms", 1e3),
    ("circle, largest error", "circle_peak_m", "um", 1e6),
    ("circle, RMS error", "circle_rms_m", "um", 1e6),
    ("rest, RMS", "rest_rms_m", "um", 1e6),
)
"""Name, field of `StepAndMove`, unit, factor from SI to the unit."""
