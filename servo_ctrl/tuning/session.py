"""Tuning of one axis over the bus, from the first weak excitation to the verification.

The session measures the frequency response, fits a modal model, proposes a setting, and measures again with
it. Where the machine contradicts the proposal, it proposes a more cautious one. Nothing is written into the
machine file here.
"""

import asyncio
import math
from typing import Any

import numpy as np

from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.control.compensation.notch import NotchSettings
from servo_ctrl.control.modal_model import ModalModel
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.excitation.measuring_motion import Plan, TuneError, plan_measurement, travel_label
from servo_ctrl.excitation.tuning_motion import TuningMotion
from servo_ctrl.recording.reader import Recording
from servo_ctrl.tuning import amplitude, measurement
from servo_ctrl.tuning.contour_partner import partner_of
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.gain_search import EncoderSteps
from servo_ctrl.tuning.machine_file import check_unchanged, sections_of, with_sections
from servo_ctrl.tuning.modal_fit import fit_modal_model
from servo_ctrl.tuning.proposal import Proposal, assess, propose
from servo_ctrl.tuning.request import TuneRequest
from servo_ctrl.tuning.results import MS_TOLERANCE, AssessedSetting, TuneResult
from servo_ctrl.tuning.runs import RunFailedError, Runs
from servo_ctrl.tuning.trial import StepAndMove, Traces, evaluate

GAIN_FACTORS = ((1.0, 1.0, 1.0), (0.25, 1.0, 0.1), (0.25, 0.25, 0.02), (0.1, 0.06, 0.002))
"""Factors on kp, kv and ki while measuring: the next row where the axis oscillates at rest.

Chosen, as are the numbers below.
"""
HUM_SHARE = 0.05
"""RMS of the force at rest, as a share of the force limit, above which the axis is taken to oscillate."""
PROBE_PERIODS, PERIODS = 2, 4
"""Periods of the multisine each way: in the weak excitation and the verification, and in the measurement."""
MEDIAN_COHERENCE_MIN = 0.5
"""Median coherence below which the report has a note."""
PROPOSALS_MAX, KP_FACTOR_AFTER_HUM = 4, 0.4
"""Bounds the proposals of a tuning, and the factor on kp after one with which the axis oscillated at rest."""
DESIGN_MS_MIN, MS_FACTOR_MIN = 1.15, 0.75
"""Bounds of the Ms of a further proposal: its least value, and its least ratio to the one before."""


class TuneRun:
    """Tunes one axis on a bus."""

    def __init__(self, request: TuneRequest, runs: Runs) -> None:
        self._machine, self._axis = request.machine, request.axis
        self._ms, self._force_n, self._report_stage = request.ms, request.force_n, request.report_stage
        self._runs = runs
        self._notes: list[str] = []

    async def run(self) -> TuneResult:
        """Measure, propose, verify. Raises TuneError."""
        axis = self._axis
        plan, response = await self._measure()
        # in a thread, so that the connection to a controller stays alive meanwhile
        model = await asyncio.to_thread(self._fit, response)
        params = axis_params(self._machine, axis)
        before = await self._assess_present(params, model, response)
        design_ms, largest_kp_1_s = self._ms, math.inf
        for attempt in range(PROPOSALS_MAX):
            proposal = await asyncio.to_thread(
                self._propose, params, model, response, ms=design_ms, largest_kp_1_s=largest_kp_1_s
            )
            sections = sections_of(
                proposal, model, has_notch=self._machine.axes[axis].section(NotchSettings) is not None
            )
            tuned = with_sections(self._machine, axis, sections)
            verified, trial, traces = await self._verify(tuned, plan)
            measured_ms = float(np.max(np.abs(verified.sensitivity)))
            self._report_stage(f"measured with these values: Ms {measured_ms:.2f}")
            too_high = measured_ms > self._ms * MS_TOLERANCE
            if not (too_high or trial.hums) or attempt == PROPOSALS_MAX - 1:
                break
            if too_high:
                design_ms = max(DESIGN_MS_MIN, design_ms * max(MS_FACTOR_MIN, 0.98 * self._ms / measured_ms))
                self._note(
                    f"measured Ms {measured_ms:.2f} is above {self._ms:g}: next proposal for {design_ms:.2f}"
                )
            if trial.hums:
                largest_kp_1_s = KP_FACTOR_AFTER_HUM * proposal.kp_1_s
                self._note(
                    f"the axis oscillates at rest: next proposal with kp at most {largest_kp_1_s:.3g} 1/s"
                )
        return TuneResult(
            machine=self._machine.machine.name,
            axis=axis,
            ms=self._ms,
            plan=plan,
            response=response,
            model=model,
            before=before,
            after=AssessedSetting(proposal.params, *proposal.assessment, trial, traces, ""),
            verified=verified,
            measured_ms=measured_ms,
            proposal=proposal,
            sections=sections,
            notes=tuple(self._notes),
        )

    async def _measure(self) -> tuple[Plan, FrequencyResponse]:
        """Measure with the first gains with which the axis stands still at rest. Raises TuneError."""
        config = self._machine.axes[self._axis]
        force_n = amplitude.probe_n(config) if self._force_n is None else self._force_n
        problem = ""
        for kp, kv, ki in GAIN_FACTORS:
            control = config.control
            values = {
                "feedback": "motor",  # the position loop on the scale may be what oscillates
                "kp_1_s": kp * control.kp_1_s,
                "ki_1_s2": 0.0,
                "kv_n_s_m": kv * control.kv_n_s_m,
                "ki_n_m": ki * control.ki_n_m,
            }
            machine = with_sections(self._machine, self._axis, {"control": values})
            self._report_stage(
                f"axis {self._axis}: measuring with kp {kp * control.kp_1_s:.3g} 1/s, kv "
                f"{kv * control.kv_n_s_m:.3g} N s/m, ki {ki * control.ki_n_m:.3g} N/m, on the motor"
            )
            try:
                plan, response, reaction = await self._travel(machine, force_n, PROBE_PERIODS)
                measuring_n = (
                    amplitude.amplitude_n(config, plan, reaction) if self._force_n is None else force_n
                )
                plan, response, _ = await self._travel(machine, measuring_n, PERIODS)
            except RunFailedError as error:
                problem = str(error)
                self._note(f"{problem}; measured again with softer gains")
                continue
            return plan, response
        raise TuneError(f"axis {self._axis} cannot be measured, with softer gains either: {problem}")

    async def _travel(
        self, machine: MachineConfig, force_n: float, periods: int
    ) -> tuple[Plan, FrequencyResponse, measurement.AxisReaction]:
        """Travel there and back with this peak force, and evaluate the recording. Raises TuneError."""
        machine = self._runs.in_present_coordinates(machine)
        plan = plan_measurement(machine, self._axis, force_n, periods)
        motion = TuningMotion(self._axis, force_n, periods)
        recording = await self._record(machine, motion, "measure")
        rest_n = recording.segment("rest")[f"{self._axis}.force_command_n"]
        rest_n = rest_n[len(rest_n) // 2 :]
        if float(np.std(rest_n)) > HUM_SHARE * machine.axes[self._axis].limits.force_n:
            raise RunFailedError(f"axis {self._axis} oscillates at rest, {float(np.std(rest_n)):.3g} N RMS")
        travels = measurement.measured_travels(plan, machine, _travel_segments(recording, plan))
        response = measurement.response_of(plan, machine, travels)
        if float(np.median(response.motor_coherence)) < MEDIAN_COHERENCE_MIN:
            median = float(np.median(response.motor_coherence))
            self._note(f"with {force_n:.3g} N the coherence is {median:.2f} only (median over the lines)")
        return plan, response, measurement.reaction_to(plan, machine, travels)

    async def _record(self, machine: MachineConfig, motion: TuningMotion, name: str) -> Recording:
        """Make a motion. Raises TuneError, also where the machine file changed before or in it.

        Gains that were proved with one file are not proved for another.
        """
        check_unchanged(self._machine)
        recording = await self._runs.record(machine, motion, name)
        check_unchanged(self._machine)
        return recording

    def _fit(self, response: FrequencyResponse) -> ModalModel:
        try:
            model = fit_modal_model(response, self._machine.period_s)
        except ValueError as error:
            raise TuneError(f"axis {self._axis}: {error}; try --force-n") from None
        self._report_stage(
            f"plant: {model.mass_kg:.4g} kg, delay {1e3 * (model.delay_s + self._machine.period_s):.2f} ms"
        )
        return model

    async def _assess_present(
        self, params: AxisParams, model: ModalModel, response: FrequencyResponse
    ) -> AssessedSetting:
        """Assess the present setting on the measured plant, and try it where the plant is stable with it."""
        assessment = assess(params, model, response)
        margins = assessment.margins
        trial, traces = None, None
        if not margins.stable:
            remark = "by the measured plant this setting is not stable: the machine was not moved with it"
        else:
            self._report_stage(f"before: Ms {margins.sensitivity_peak:.2f}; step of force, move and circle")
            remark = ""
            try:
                machine = self._runs.in_present_coordinates(self._machine)
                recording = await self._record(machine, TuningMotion(self._axis, trial=True), "before")
                trial, traces = evaluate(machine, self._axis, recording.segment)
            except RunFailedError as error:
                remark = str(error)
        if remark:
            self._note(f"before: {remark}")
        return AssessedSetting(params, *assessment, trial, traces, remark)

    def _propose(
        self,
        params: AxisParams,
        model: ModalModel,
        response: FrequencyResponse,
        ms: float,
        largest_kp_1_s: float,
    ) -> Proposal:
        config = self._machine.axes[self._axis]
        motor_m = drive_scaling(config).metre_per_count
        feedback_m = scale_metre_per_count(config) if params.position_loop.scale_feedback else motor_m
        steps = EncoderSteps(motor_m, feedback_m)
        partner = partner_of(self._machine, self._axis)
        try:
            proposal = propose(
                params, model, response, ms, steps, largest_kp_1_s=largest_kp_1_s, partner=partner
            )
        except ValueError as error:
            raise TuneError(f"axis {self._axis}: {error}") from None
        notched = "" if proposal.notch is None else f", notch at {proposal.notch.frequency_hz:g} Hz"
        self._report_stage(
            f"proposed for Ms {ms:.3g}: kp {proposal.kp_1_s:g} 1/s, kv {proposal.kv_n_s_m:g} N s/m, "
            f"ki {proposal.ki_n_m:g} N/m{notched}"
        )
        return proposal

    async def _verify(
        self, tuned: MachineConfig, plan: Plan
    ) -> tuple[FrequencyResponse, StepAndMove, Traces]:
        """Measure with the proposed values, and make their trial, in one run. Raises TuneError."""
        machine = self._runs.in_present_coordinates(tuned)
        plan_again = plan_measurement(machine, self._axis, plan.amplitude_n, PROBE_PERIODS)
        motion = TuningMotion(self._axis, plan.amplitude_n, PROBE_PERIODS, trial=True)
        try:
            recording = await self._record(machine, motion, "after")
        except RunFailedError as error:
            raise TuneError(f"with the proposed values {error}; nothing was changed") from None
        travels = measurement.measured_travels(plan_again, machine, _travel_segments(recording, plan_again))
        verified = measurement.response_of(plan_again, machine, travels)
        return verified, *evaluate(machine, self._axis, recording.segment)

    def _note(self, text: str) -> None:
        self._notes.append(text)
        self._report_stage(text)


def _travel_segments(recording: Recording, plan: Plan) -> list[dict[str, Any]]:
    return [recording.segment(travel_label(k)) for k in range(len(plan.travels))]
