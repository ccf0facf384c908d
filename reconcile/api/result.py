"""The typed result of `reconcile.diagnose`: findings, the repaired model, plots, a display for notebooks."""

import html
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from reconcile.formats.toml_file import document_of, toml_text, with_absolute_paths
from reconcile.location.residual_analysis import MODELS, ResidualAnalysis
from servo_ctrl.plots.matplotlib_agg import Figure


@dataclass(frozen=True)
class Parameter:
    """An identified number with its 95 % confidence interval, in `unit`."""

    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Finding:
    """An effect that the model lacks."""

    axis: str
    effect: str
    confidence: float
    share: float
    """Share of the variance of the residual that it explains."""
    explanation: str
    parameters: dict[str, Parameter]
    equivalent: tuple[str, ...]
    """Effects that these recordings cannot distinguish from it."""


@dataclass(frozen=True)
class RepairedModel:
    """The model with the identified effects; complete, so that `hil-sim run` can run it."""

    document: dict[str, Any]
    """The content of the TOML file; paths to EDS files are absolute."""

    def to_toml(self) -> str:
        """Return the text of a plant.toml."""
        return toml_text(self.document)


@dataclass(frozen=True)
class Plots:
    """Figures of matplotlib."""

    analyses: tuple[ResidualAnalysis, ...] = field(repr=False)

    def residual(self) -> Figure:
        """Return the residual over time: one row for each axis and channel; nominal, refitted, repaired.

        Samples that do not count, while filters settle and at standstill, are left out.
        """
        figure = Figure(figsize=(9.0, 2.6 * max(1, len(self.analyses))), layout="constrained")
        rows = figure.subplots(max(1, len(self.analyses)), 1, squeeze=False)[:, 0]
        for axes, one in zip(rows, self.analyses, strict=False):
            for model in MODELS:
                start_s = 0.0
                for number, residual in enumerate(one.residuals):
                    time_s = residual.data.time_s
                    values = np.where(residual.used, getattr(residual, model), np.nan)
                    label = model if number == 0 else None
                    axes.plot(start_s + time_s, values, color=f"C{MODELS.index(model)}", lw=0.7, label=label)
                    start_s += float(time_s[-1])
            axes.set(title=f"{one.axis}: {one.channel.value}", xlabel="time, s")
            axes.legend(loc="upper right")
        return figure


@dataclass(frozen=True)
class Diagnosis:
    """The result of a diagnosis: the effects that a simulation lacks."""

    verdict: dict[str, Any] = field(repr=False)
    """The content of verdict.json."""
    findings: tuple[Finding, ...]
    """The largest first."""
    model: RepairedModel = field(repr=False)
    plot: Plots = field(repr=False)

    def _repr_html_(self) -> str:
        """Return the table that a notebook shows."""
        rows = "".join(
            f"<tr><td>{html.escape(one.axis)}</td><td>{html.escape(one.effect)}</td>"
            f"<td>{one.confidence:.0%}</td><td>{one.share:.0%}</td><td>{html.escape(one.explanation)}</td></tr>"
            for one in self.findings
        )
        head = "".join(
            f"<th>{word}</th>" for word in ("axis", "effect", "confidence", "share", "explanation")
        )
        word = html.escape(str(self.verdict["verdict"]))
        return (
            f"<p>Verdict: <b>{word}</b></p><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        )


def findings_of(verdict: dict[str, Any]) -> tuple[Finding, ...]:
    """Return the findings of a verdict, typed."""
    return tuple(
        Finding(
            axis=one["axis"],
            effect=one["effect"],
            confidence=one["confidence"],
            share=one["share"],
            explanation=one["explanation"],
            parameters={
                key: Parameter(of["value"], of["ci95"][0], of["ci95"][1], of["unit"])
                for key, of in one["parameters"].items()
            },
            equivalent=tuple(one["equivalent"]),
        )
        for one in verdict["findings"]
    )


def repaired_model(file: Path) -> RepairedModel:
    """Read a written model.toml, with absolute paths. Raises ReconcileError."""
    return RepairedModel(with_absolute_paths(document_of(file), file.parent))
