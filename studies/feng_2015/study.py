"""Figures of the study of Feng et al. 2015, section 5: errors, reductions, and the published bars."""

from statistics import fmean
from typing import Any, NamedTuple

from servo_ctrl.learning.types import Learned
from servo_ctrl.metrology.circles import AXES, ReversalFigures, figures_um
from studies.feng_2015.published import FENG_2015_CLAIMS_PERCENT
from studies.feng_2015.strokes import BusLearning, RepeatedStroke
from studies.feng_2015.twin_learning import TwinLearning
from studies.feng_2015.variants import OBSERVER, PULSE, WITHOUT, VariantResult
from studies.feng_2015.waveform_study import WAVEFORM, WaveformStudy, learning_figures

UM = 1e6


class Cell(NamedTuple):
    """One motion of one axis, measured in all variants."""

    group: str
    """Group of the published claims: "x" and "y" on circles, "S" on the S-shaped motions."""
    label: str
    feed_mm_min: int
    """0 for an S-shaped motion."""
    figures: dict[str, ReversalFigures]


class ReductionBar(NamedTuple):
    """One indicator of one cell against the published claim and against the observer."""

    cell: Cell
    indicator: str
    reduction_percent: float
    claim_percent: float
    below_observer: bool

    @property
    def met(self) -> bool:
        """Whether the reduction reaches the claim and the error is below the observer's."""
        return self.reduction_percent >= self.claim_percent and self.below_observer


class FrictionStudy(NamedTuple):
    """Results of the whole study."""

    results: dict[str, VariantResult]
    paper: TwinLearning
    fast: TwinLearning
    repeated: list[RepeatedStroke]
    seed: int
    bus: BusLearning | None
    wall_s: float
    processor_s: float
    """Seconds on processors, of all programs of the study."""
    waveforms: WaveformStudy
    """Learned waveforms, and rivals in the batch twin."""


def cells(results: dict[str, VariantResult]) -> list[Cell]:
    """Return the cells: circles of x, circles of y, S-shaped motions, in the order of the programs."""
    circles = results[WITHOUT].circles
    found = [
        Cell(
            axis,
            f"F {circle.feed_mm_min}",
            circle.feed_mm_min,
            {name: figures_um(result.circles[i].indicators[axis]) for name, result in results.items()},
        )
        for axis in AXES
        for i, circle in enumerate(circles)
    ]
    shapes = results[WITHOUT].shapes
    return found + [
        Cell("S", shape.name, 0, {name: result.shapes[i].figures for name, result in results.items()})
        for i, shape in enumerate(shapes)
    ]


def reductions_percent(cell: Cell, variant: str = PULSE) -> ReversalFigures:
    """Return the reduction of each indicator against no compensation, per cent."""
    pairs = zip(cell.figures[variant], cell.figures[WITHOUT], strict=True)
    return ReversalFigures(*(100.0 * (1.0 - with_it / without) for with_it, without in pairs))


def bars(cell: Cell) -> list[ReductionBar]:
    """Return one bar for each indicator."""
    reduced, claims = reductions_percent(cell), FENG_2015_CLAIMS_PERCENT[cell.group]
    return [
        ReductionBar(cell, name, reduction, claim, with_pulse < with_observer)
        for name, reduction, claim, with_pulse, with_observer in zip(
            ReversalFigures._fields, reduced, claims, cell.figures[PULSE], cell.figures[OBSERVER], strict=True
        )
    ]


def missed(found: list[Cell]) -> list[ReductionBar]:
    """Return the bars that were not met."""
    return [bar for cell in found for bar in bars(cell) if not bar.met]


def all_cells(study: FrictionStudy) -> list[Cell]:
    """Return the cells of all variants, and of the learned waveforms."""
    figures = study.waveforms.figures
    return [
        cell._replace(figures={**cell.figures, WAVEFORM: figures[cell.group, cell.label]})
        for cell in cells(study.results)
    ]


def summary(study: FrictionStudy) -> dict[str, Any]:
    """Return the whole study for JSON: micrometres, per cent, seconds."""
    found = all_cells(study)
    return {
        "circle": [
            {"axis": cell.group, "feed_mm_min": cell.feed_mm_min, **_entry(cell)}
            for cell in found
            if cell.group in AXES
        ],
        "s_shaped": [{"name": cell.label, **_entry(cell)} for cell in found if cell.group == "S"],
        "learning": _learning(study),
        "rivals": study.waveforms.rivals,
        "bars_missed": [
            {
                "where": f"{bar.cell.group} {bar.cell.label}",
                "indicator": bar.indicator,
                "reduction_percent": bar.reduction_percent,
                "claim_percent": bar.claim_percent,
                "below_WDOB": bar.below_observer,
            }
            for bar in missed(found)
        ],
        "times_real_time": {name: result.times_real_time for name, result in study.results.items()},
        "wall_s": study.wall_s,
        "processor_s": study.processor_s,
    }


def _entry(cell: Cell) -> dict[str, Any]:
    figures = {name: values._asdict() for name, values in cell.figures.items()}
    reductions = {name: reductions_percent(cell, name) for name in cell.figures if name != WITHOUT}
    return {
        **figures,
        "reductions_percent": {
            name: {key.removesuffix("_um"): value for key, value in values._asdict().items()}
            for name, values in reductions.items()
        },
        "bars_met": all(bar.met for bar in bars(cell)),
    }


def _learning(study: FrictionStudy) -> dict[str, Any]:
    figures: dict[str, Any] = {"unit": "um"}
    for name, twin in (("paper", study.paper), ("fast", study.fast)):
        learned = {axis: entry.learned for axis, entry in twin.axes.items()}
        figures |= _totals(name, learned)
        figures[name] = {
            "made": "batch twin",
            "wall_s": twin.wall_s,
            "axes": {
                axis: {
                    **_outcome(entry.learned),
                    "wall_s": entry.wall_s,
                    "times_real_time": entry.times_real_time,
                    "strokes_per_s": len(entry.strokes) / entry.wall_s,
                }
                for axis, entry in twin.axes.items()
            },
        }
    if study.bus is not None:
        figures |= _totals("bus", study.bus.axes)
        figures["bus"] = {
            "made": "bus, in lockstep",
            "wall_s": study.bus.wall_s,
            "times_real_time": study.bus.times_real_time,
            "axes": {axis: _outcome(learned) for axis, learned in study.bus.axes.items()},
        }
    figures["waveforms"] = learning_figures(study.waveforms)
    figures["repeated_on_bus"] = {
        "seed": study.seed,
        "strokes": [
            {
                "axis": entry.axis,
                "stage": entry.stroke.stage,
                "acceleration_mm_s2": entry.stroke.acceleration_m_s2 * 1e3,
                "J_twin": entry.twin_m * UM,
                "J_bus": entry.bus_m * UM,
                "same": entry.same,
            }
            for entry in study.repeated
        ],
    }
    return figures


def _totals(name: str, learned: dict[str, Learned]) -> dict[str, float]:
    """Return the strokes of all axes, and J over the check strokes as the mean of the axes."""
    return {
        f"strokes_{name}": sum(entry.strokes for entry in learned.values()),
        f"J_{name}": fmean(entry.after_m * UM for entry in learned.values()),
    }


def _outcome(learned: Learned) -> dict[str, float]:
    return {
        "strokes": learned.strokes,
        "machine_time_s": learned.machine_time_s,
        "before": learned.before_m * UM,
        "after": learned.after_m * UM,
    }
