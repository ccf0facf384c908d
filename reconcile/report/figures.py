"""The figures of one analysed residual: over time, over coordinates, by direction, spectra and whiteness."""

import html
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from kernels.arrays import Array, true_runs
from kernels.readable_units import display_unit
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.formats.rotary_units import unit_of
from reconcile.location.coordinates import Coordinate
from reconcile.location.locate import in_phase
from reconcile.location.residual_analysis import MODELS, ResidualAnalysis, residuals_of_model
from reconcile.location.search_bands import order_bands, over_turns, periods
from reconcile.location.spectra import spectrum
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
DECADES_BELOW, DECADES_ABOVE = 4.5, 0.5
"""Range of a spectral density around its highest point; below are numerical zeros."""
WHITE_PROBABILITY = 0.05
"""Ljung-Box probability below which a residual is not called white; the customary level."""


def figures(analysis: ResidualAnalysis, buckets: int) -> list[Figure]:
    """Return all figures of a residual; time series are thinned to `buckets` of two points each."""
    plotter = _Plotter(analysis)
    profiles = ResidualProfiles(analysis)
    drawn = [plotter.over_time(number, buckets) for number in range(len(analysis.residuals))]
    if analysis.channel is ResidualChannel.POSITION_DEVIATION:
        drawn += plotter.scale_less_motor(profiles.by_direction("position"))
    drawn += [plotter.over_coordinate(profile) for profile in profiles.best()]
    drawn += plotter.after_reversal(profiles.by_direction("distance_since_reversal"))
    return [*drawn, plotter.spectrum(), *plotter.orders(), plotter.whiteness()]


class _Plotter:
    """Draws one residual in a unit that suits its size."""

    def __init__(self, analysis: ResidualAnalysis) -> None:
        self._analysis, self._rotary = analysis, analysis.nominal.rotary
        nominal = np.concatenate([residual.before[residual.used] for residual in analysis.residuals])
        self._factor, self._unit = display_unit(
            unit_of(analysis.floor.unit, rotary=self._rotary), float(np.abs(nominal).max(initial=0.0))
        )
        self._noise_floor = analysis.floor.rms / self._factor

    def over_time(self, number: int, buckets: int) -> Figure:
        """Draw the residual of one recording over time, the position below it."""
        residual = self._analysis.residuals[number]
        time_s = residual.data.time_s
        data = []
        for model in MODELS:
            y = np.where(residual.used, getattr(residual, model) / self._factor, np.nan)
            data.append(line(model, *thinned(time_s, y, buckets), name=MODEL_NAMES[model]))
        factor, unit = (1.0, "rad") if self._rotary else (1e-3, "mm")
        x, y = thinned(time_s, residual.data.motion.position_m / factor, buckets // 2)
        data.append({**line("position", x, y, name="position"), "yaxis": "y2", "showlegend": False})
        force = "torque" if self._rotary else "force"
        missed = force if self._analysis.channel is ResidualChannel.FORCE else "deviation"
        figure_layout = stacked(f"{missed} missed ({self._unit})", f"position ({unit})", lower_height=0.22)
        held_out = [
            interval_band(float(time_s[first]), float(time_s[end - 1]), "--held-out")
            for first, end in true_runs(residual.held_out)
        ]
        figure_layout["shapes"] = [*held_out, band(2.0 * self._noise_floor)]
        floor = self._noise_floor
        note = f"{residual.source}. Grey band: noise floor, twice its RMS of {floor:.3g} {self._unit}."
        note += " Shaded stretches were held out: nothing was fitted to them." if held_out else ""
        return Figure(f"time-{number}", "Over time", note, data, figure_layout)

    def over_coordinate(self, profile: ResidualProfile) -> Figure:
        coordinate = profile.coordinate
        factor, unit = self._coordinate_unit(coordinate)
        x: Any = packed(coordinate.centres / factor)
        if coordinate.labels:
            x = [html.escape(label) for label in coordinate.labels]
        has_samples = profile.counts > 0.0
        data = []
        for model in MODELS:
            y = np.where(has_samples, profile.means[model] / self._factor, np.nan)
            error = np.where(has_samples, 2.0 * profile.errors[model] / self._factor, 0.0)
            data.append(dots(model, x, y, error, categories=bool(coordinate.labels)))
        name = display_name(coordinate.name)
        signed = " times direction" if profile.by_direction else ""
        x_title, y_title = f"{name} ({unit})" if unit else name, f"mean{signed} ({self._unit})"
        figure_layout = _coordinate_layout(coordinate, x_title, y_title)
        figure_layout["shapes"] = [band(self._noise_floor)]
        note = f"Explains {100.0 * profile.share:.1f} % of what no value of the nominal model explains"
        note += " (on blocks left out of the mean)" if profile.share > 0.0 else ""
        note += "; its sign turns with the direction of motion." if profile.by_direction else "."
        return Figure(f"over-{coordinate.name}", f"Over the {name}", note, data, figure_layout)

    def scale_less_motor(self, profiles: Mapping[str, ResidualProfile]) -> list[Figure]:
        """Draw the measured deviation over the travel, less its mean."""
        if not profiles:
            return []
        coordinate = profiles["forwards"].coordinate
        bin_means = [profile.means[MEASURED][profile.counts > 0.0] for profile in profiles.values()]
        mean = float(np.concatenate(bin_means).mean()) if any(map(len, bin_means)) else 0.0
        data = []
        for direction, profile in profiles.items():
            role = {"forwards": "before", "backwards": "after"}[direction]
            y = profile.means[MEASURED] / self._factor - mean / self._factor
            data.append(self._line_of_direction(direction, profile, y, role, direction))
        note = "As measured, less its mean. A gap between the directions is lost motion, a slope the lead."
        figure_layout = self._mean_layout(coordinate)
        return [Figure("scale-less-motor", "Scale less motor over the travel", note, data, figure_layout)]

    def after_reversal(self, profiles: Mapping[str, ResidualProfile]) -> list[Figure]:
        """Draw the residual over the distance since the last reversal."""
        if not profiles:
            return []
        coordinate = profiles["forwards"].coordinate
        data = [
            self._line_of_direction(
                direction,
                profile,
                profile.means[model] / self._factor,
                model,
                f"{MODEL_NAMES[model]}, {direction}",
            )
            for direction, profile in profiles.items()
            for model in ("before", "after")
        ]
        figure_layout = self._mean_layout(coordinate)
        figure_layout["shapes"] = [band(self._noise_floor)]
        note = "A step that is there at once is play or Coulomb friction, one that grows is presliding."
        return [Figure("since-reversal", "After a reversal", note, data, figure_layout)]

    def spectrum(self) -> Figure:
        """Draw the spectral density of the residual, and that of the noise floor."""
        residuals = self._analysis.residuals
        data = []
        frequency_hz, highest = np.zeros(1), 1e-300
        for model in ("before", "after"):
            frequency_hz, density = spectral_density(residuals, residuals_of_model(residuals, model))
            y = np.sqrt(np.maximum(density, 0.0)) / self._factor
            highest = max(highest, float(y[1:].max()))
            data.append(line(model, frequency_hz[1:], y[1:], name=MODEL_NAMES[model]))
        noise_density = floor_density(self._analysis.floor, frequency_hz, residuals[0].data.period_s)
        noise = np.sqrt(noise_density) / self._factor
        data.append(line("floor", frequency_hz[1:], noise[1:], name="noise floor"))
        data[-1]["line"]["dash"] = "dash"
        figure_layout = layout("frequency (Hz)", f"density ({self._unit}/√Hz)")
        figure_layout["xaxis"].update(LOGARITHMIC)
        figure_layout["yaxis"].update(LOGARITHMIC)
        decade = math.log10(highest)
        figure_layout["yaxis"]["range"] = [decade - DECADES_BELOW, decade + DECADES_ABOVE]
        note = "A line is a disturbance fixed in time, a hump a resonance; the filter takes off above 60 Hz."
        return Figure("spectrum", "Spectrum", note, data, figure_layout)

    def orders(self) -> list[Figure]:
        """Draw the spectrum over cycles per turn; nothing where the axis moved too little."""
        axis, residuals = self._analysis.nominal, self._analysis.residuals
        bands, data = order_bands(axis), []
        for model in ("before", "after"):
            tracks = [
                over_turns(residual, in_phase(residual, getattr(residual, model))) for residual in residuals
            ]
            order_spectrum = spectrum(tracks, bands)
            if not len(order_spectrum.cycles):
                return []
            amplitude = order_spectrum.amplitude / self._factor
            x, y = peaks(order_spectrum.cycles, amplitude, SPECTRUM_POINTS)
            data.append(line(model, x, y, name=MODEL_NAMES[model]))
        figure_layout = layout("cycles a turn", f"amplitude ({self._unit})")
        figure_layout["xaxis"].update(LOGARITHMIC)
        marked = periods(axis)
        figure_layout["shapes"] = [upright(period.cycles_per_turn) for period in marked]
        figure_layout["annotations"] = [
            mark(f"1 a {period.name}", period.cycles_per_turn) for period in marked
        ]
        note = (
            "What repeats with the travel, not with time: screw, motor poles, grating. Weighted with the "
            "part of the samples that are slow enough to show it."
        )
        return [Figure("orders", "Order spectrum", note, data, figure_layout)]

    def whiteness(self) -> Figure:
        """Draw the autocorrelation of the residual, with the band of white noise."""
        by_model = self._analysis.whiteness_by_model
        data = [
            dots(model, packed(by_model[model].lags_s), by_model[model].correlation, None, categories=False)
            for model in ("before", "after")
        ]
        figure_layout = layout("lag (s)", "autocorrelation")
        bound, p = by_model["after"].bound, by_model["after"].probability
        figure_layout["shapes"] = [band(bound)]
        figure_layout["yaxis"]["range"] = [-1.0, 1.0]
        conclusion = "could be white noise" if p > WHITE_PROBABILITY else "is not white noise"
        note = f"Grey band: 95 % of white noise. The residual {conclusion} (Ljung-Box, p = {p:.2g})."
        return Figure("whiteness", "Is the residual noise?", note, data, figure_layout)

    def _line_of_direction(
        self, direction: str, profile: ResidualProfile, y: Array, role: str, name: str
    ) -> dict[str, Any]:
        """Return a line over the bins that have samples; forwards solid, backwards dashed."""
        factor, _ = self._coordinate_unit(profile.coordinate)
        has_samples = profile.counts > 0.0
        trace = line(role, profile.coordinate.centres[has_samples] / factor, y[has_samples], name=name)
        trace["mode"] = "lines+markers"
        is_forwards = direction == "forwards"
        trace["marker"] = {"symbol": "triangle-right" if is_forwards else "triangle-left", "size": 7}
        trace["line"]["dash"] = "solid" if is_forwards else "dash"
        return trace

    def _coordinate_unit(self, coordinate: Coordinate) -> tuple[float, str]:
        edges = coordinate.edges
        size = float(np.sqrt(edges[0] * edges[-1])) if edges[0] > 0.0 else float(np.abs(edges).max())
        return display_unit(unit_of(coordinate.unit, rotary=self._rotary), size)

    def _mean_layout(self, coordinate: Coordinate) -> dict[str, Any]:
        """Return the layout of a mean over a coordinate that has a unit."""
        _, unit = self._coordinate_unit(coordinate)
        x_title = f"{display_name(coordinate.name)} ({unit})"
        return _coordinate_layout(coordinate, x_title, f"mean ({self._unit})")


def _coordinate_layout(coordinate: Coordinate, x_title: str, y_title: str) -> dict[str, Any]:
    figure_layout = layout(x_title, y_title)
    if coordinate.logarithmic:
        figure_layout["xaxis"].update(LOGARITHMIC)
    return figure_layout
