"""The figures of one analysed residual: over time, over coordinates, by direction, spectra and whiteness."""

import html
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from kernels.readable_units import display_unit
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.rotary_units import unit_of
from reconcile.location.coordinates import Coordinate
from reconcile.location.locate import in_phase
from reconcile.location.residual_analysis import MODELS, ResidualAnalysis, residuals_of_model
from reconcile.location.search_bands import order_bands, over_turns, periods
from reconcile.location.spectra import spectrum
from reconcile.regression.residual import Residual
from reconcile.regression.residual_noise import floor_density, spectral_density
from reconcile.report.residual_profiles import MEASURED, ResidualProfile, ResidualProfiles
from reconcile.report.traces import (
    LOGARITHMIC,
    MODEL_NAMES,
    Figure,
    band,
    dots,
    interval_band,
    layout,
    line,
    mark,
    peaks,
    stacked,
    upright,
)
from reconcile.report.words import display_name
from servo_ctrl.recording.min_max import thinned
from servo_ctrl.report.html_file import packed

SPECTRUM_POINTS = 1500
"""Most points of a spectrum: more than a wide screen has pixels."""
WHITE_PROBABILITY = 0.05
"""Ljung-Box probability below which a residual is not called white; the customary level."""


def figures(analysis: ResidualAnalysis, buckets: int) -> list[Figure]:
    """Return all figures of a residual; time series are thinned to `buckets` of two points each."""
    plotter = _Plotter(analysis)
    profiles = ResidualProfiles(analysis)
    found = [plotter.over_time(one, number, buckets) for number, one in enumerate(analysis.residuals)]
    if analysis.channel is ResidualChannel.POSITION_DEVIATION:
        found += plotter.scale_less_motor(profiles.by_direction("position"))
    found += [plotter.over_coordinate(profile) for profile in profiles.best()]
    found += plotter.after_reversal(profiles.by_direction("distance_since_reversal"))
    return [*found, plotter.spectrum(), *plotter.orders(), plotter.whiteness()]


class _Plotter:
    """Draws one residual in a unit that suits its size."""

    def __init__(self, analysis: ResidualAnalysis) -> None:
        self._analysis, self._rotary = analysis, analysis.nominal.rotary
        nominal = np.concatenate([one.before[one.used] for one in analysis.residuals])
        self._factor, self._unit = display_unit(
            unit_of(analysis.floor.unit, rotary=self._rotary), float(np.abs(nominal).max(initial=0.0))
        )
        self._floor = analysis.floor.rms / self._factor

    def over_time(self, residual: Residual, number: int, buckets: int) -> Figure:
        t = residual.data.time_s
        data = []
        for model in MODELS:
            y = np.where(residual.used, getattr(residual, model) / self._factor, np.nan)
            data.append(line(model, *thinned(t, y, buckets), name=MODEL_NAMES[model]))
        size, unit = (1.0, "rad") if self._rotary else (1e-3, "mm")
        x, y = thinned(t, residual.data.motion.position_m / size, buckets // 2)
        data.append({**line("position", x, y, name="position"), "yaxis": "y2", "showlegend": False})
        force = self._analysis.channel is ResidualChannel.FORCE
        title = f"{('torque' if self._rotary else 'force') if force else 'deviation'} missed ({self._unit})"
        drawing = stacked(title, f"position ({unit})", lower_height=0.22)
        held_out = [
            interval_band(float(t[first]), float(t[last - 1]), "--held-out")
            for first, last in _intervals(residual.held_out)
        ]
        drawing["shapes"] = [*held_out, band(2.0 * self._floor)]
        note = f"{residual.source}. Grey band: noise floor, twice its RMS of {self._floor:.3g} {self._unit}."
        note += " Shaded stretches were held out: nothing was fitted to them." if held_out else ""
        return Figure(f"time-{number}", "Over time", note, data, drawing)

    def over_coordinate(self, profile: ResidualProfile) -> Figure:
        coordinate = profile.coordinate
        factor, unit = self._coordinate_unit(coordinate)
        x: Any = packed(coordinate.centres / factor)
        if coordinate.labels:
            x = [html.escape(label) for label in coordinate.labels]
        filled = profile.counts > 0.0
        data = []
        for model in MODELS:
            y = np.where(filled, profile.means[model] / self._factor, np.nan)
            error = np.where(filled, 2.0 * profile.errors[model] / self._factor, 0.0)
            data.append(dots(model, x, y, error, categories=bool(coordinate.labels)))
        name = display_name(coordinate.name)
        turned = " times direction" if profile.by_direction else ""
        drawing = self._over(coordinate, f"{name} ({unit})" if unit else name, f"mean{turned} ({self._unit})")
        drawing["shapes"] = [band(self._floor)]
        note = f"Explains {100.0 * profile.share:.1f} % of what no value of the nominal model explains"
        note += " (on blocks left out of the mean)" if profile.share > 0.0 else ""
        note += "; its sign turns with the direction of motion." if profile.by_direction else "."
        return Figure(f"over-{coordinate.name}", f"Over the {name}", note, data, drawing)

    def scale_less_motor(self, profiles: Mapping[str, ResidualProfile]) -> list[Figure]:
        """Draw the measured deviation over the travel, less its mean."""
        if not profiles:
            return []
        coordinate = profiles["forwards"].coordinate
        levels = [profile.means[MEASURED][profile.counts > 0.0] for profile in profiles.values()]
        mean = float(np.concatenate(levels).mean()) if any(map(len, levels)) else 0.0
        data = []
        for direction, profile in profiles.items():
            role = {"forwards": "before", "backwards": "after"}[direction]
            y = profile.means[MEASURED] / self._factor - mean / self._factor
            data.append(self._by_direction(direction, profile, y, role, direction))
        note = "As measured, less its mean. A gap between the directions is lost motion, a slope the lead."
        drawing = self._over_unit(coordinate)
        return [Figure("scale-less-motor", "Scale less motor over the travel", note, data, drawing)]

    def after_reversal(self, profiles: Mapping[str, ResidualProfile]) -> list[Figure]:
        """Draw the residual over the distance since the last reversal."""
        if not profiles:
            return []
        coordinate = profiles["forwards"].coordinate
        data = [
            self._by_direction(
                direction,
                profile,
                profile.means[model] / self._factor,
                model,
                f"{MODEL_NAMES[model]}, {direction}",
            )
            for direction, profile in profiles.items()
            for model in ("before", "after")
        ]
        drawing = self._over_unit(coordinate)
        drawing["shapes"] = [band(self._floor)]
        note = "A step that is there at once is play or Coulomb friction, one that grows is presliding."
        return [Figure("since-reversal", "After a reversal", note, data, drawing)]

    def spectrum(self) -> Figure:
        residuals = self._analysis.residuals
        data = []
        f, highest = np.zeros(1), 1e-300
        for model in ("before", "after"):
            f, density = spectral_density(residuals, residuals_of_model(residuals, model))
            y = np.sqrt(np.maximum(density, 0.0)) / self._factor
            highest = max(highest, float(y[1:].max()))
            data.append(line(model, f[1:], y[1:], name=MODEL_NAMES[model]))
        floor = np.sqrt(floor_density(self._analysis.floor, f, residuals[0].data.period_s)) / self._factor
        data.append(line("floor", f[1:], floor[1:], name="noise floor"))
        data[-1]["line"]["dash"] = "dash"
        drawing = layout("frequency (Hz)", f"density ({self._unit}/√Hz)")
        drawing["xaxis"].update(LOGARITHMIC)
        drawing["yaxis"].update(LOGARITHMIC)
        drawing["yaxis"]["range"] = [math.log10(highest) - 4.5, math.log10(highest) + 0.5]
        note = "A line is a disturbance fixed in time, a hump a resonance; the filter takes off above 60 Hz."
        return Figure("spectrum", "Spectrum", note, data, drawing)

    def orders(self) -> list[Figure]:
        """Draw the spectrum over cycles per turn; nothing where the axis moved too little."""
        axis, residuals = self._analysis.nominal, self._analysis.residuals
        bands, data = order_bands(axis), []
        for model in ("before", "after"):
            tracks = [over_turns(one, in_phase(one, getattr(one, model))) for one in residuals]
            cycles, amplitude = spectrum(tracks, bands)
            if not len(cycles):
                return []
            x, y = peaks(cycles, amplitude / self._factor, SPECTRUM_POINTS)
            data.append(line(model, x, y, name=MODEL_NAMES[model]))
        drawing = layout("cycles a turn", f"amplitude ({self._unit})")
        drawing["xaxis"].update(LOGARITHMIC)
        marks = periods(axis)
        drawing["shapes"] = [upright(at) for _, at in marks]
        drawing["annotations"] = [mark(f"1 a {name}", at) for name, at in marks]
        note = (
            "What repeats with the travel, not with time: screw, motor poles, grating. Weighted with the "
            "part of the samples that are slow enough to show it."
        )
        return [Figure("orders", "Order spectrum", note, data, drawing)]

    def whiteness(self) -> Figure:
        by_model = self._analysis.whiteness_by_model
        data = [
            dots(model, packed(by_model[model].lags_s), by_model[model].correlation, None, categories=False)
            for model in ("before", "after")
        ]
        drawing = layout("lag (s)", "autocorrelation")
        bound, p = by_model["after"].bound, by_model["after"].probability
        drawing["shapes"] = [band(bound)]
        drawing["yaxis"]["range"] = [-1.0, 1.0]
        conclusion = "could be white noise" if p > WHITE_PROBABILITY else "is not white noise"
        note = f"Grey band: 95 % of white noise. The residual {conclusion} (Ljung-Box, p = {p:.2g})."
        return Figure("whiteness", "Is the residual noise?", note, data, drawing)

    def _by_direction(
        self, direction: str, profile: ResidualProfile, y: Array, role: str, name: str
    ) -> dict[str, Any]:
        """Return a line over the filled bins; forwards solid, backwards dashed."""
        factor, _ = self._coordinate_unit(profile.coordinate)
        filled = profile.counts > 0.0
        trace = line(role, profile.coordinate.centres[filled] / factor, y[filled], name=name)
        trace["mode"] = "lines+markers"
        forwards = direction == "forwards"
        trace["marker"] = {"symbol": "triangle-right" if forwards else "triangle-left", "size": 7}
        trace["line"]["dash"] = "solid" if forwards else "dash"
        return trace

    def _coordinate_unit(self, coordinate: Coordinate) -> tuple[float, str]:
        edges = coordinate.edges
        size = float(np.sqrt(edges[0] * edges[-1])) if edges[0] > 0.0 else float(np.abs(edges).max())
        return display_unit(unit_of(coordinate.unit, rotary=self._rotary), size)

    def _over_unit(self, coordinate: Coordinate) -> dict[str, Any]:
        _, unit = self._coordinate_unit(coordinate)
        return self._over(coordinate, f"{display_name(coordinate.name)} ({unit})", f"mean ({self._unit})")

    def _over(self, coordinate: Coordinate, x: str, y: str) -> dict[str, Any]:
        drawing = layout(x, y)
        if coordinate.logarithmic:
            drawing["xaxis"].update(LOGARITHMIC)
        return drawing


def _intervals(mask: NDArray[np.bool_]) -> Sequence[tuple[int, int]]:
    """Return first and one past last sample of each run of True."""
    edges = np.flatnonzero(np.diff(mask.astype(np.int8), prepend=0, append=0))
    return [(int(first), int(last)) for first, last in zip(edges[::2], edges[1::2], strict=True)]
