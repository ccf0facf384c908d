"""Tuning over the bus, from the first weak excitation to the proof: one run of the machine after the other.

Each run boots, makes its program and stops in order, with all checks of any run; a signal ends the one that
goes on, and with it the tuning. Nothing is written into the machine file here.
"""

import math
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from servo_ctrl.canopen.scaling import drive_scaling, scale_metre_per_count
from servo_ctrl.config.freeze import axis_params
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.control.compensation.disturbance_observer import DisturbanceObserverSettings
from servo_ctrl.control.compensation.fuzzy_pd import FuzzyPdSettings
from servo_ctrl.control.compensation.notch import NotchSettings
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.daemon.run.report import Pacing, Progress
from servo_ctrl.daemon.run.stop_signals import exit_status_after
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.recording.reader import Recording, load_recording
from servo_ctrl.tuning import amplitude, measurement
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.loop import Margins, Plant
from servo_ctrl.tuning.machine_file import Sections, sections_of, with_sections
from servo_ctrl.tuning.measurement import Plan, TuneError
from servo_ctrl.tuning.modal_model import ModalModel, fit_modal_model
from servo_ctrl.tuning.proposal import EncoderSteps, Proposal, judged, propose
from servo_ctrl.tuning.trial import StepAndMove, Traces, evaluate, proving_steps
from servo_ctrl.units import MM

SOFTNESS = ((1.0, 1.0, 1.0), (0.25, 1.0, 0.1), (0.25, 0.25, 0.02), (0.1, 0.06, 0.002))
"""Factors on kp, kv and ki with which it is measured: the next where the axis hums. Chosen, as all here."""
HUM_SHARE = 0.05
"""Of the force limit: the RMS of the force at rest from which the axis hums."""
PROBE_PERIODS, PERIODS = 2, 4
LEAST_MEDIAN_COHERENCE = 0.5
ATTEMPTS, MS_TOLERANCE, SOFTER_KP = 4, 1.03, 0.4
"""How often it is proposed, factor by which Ms may be above the stated one, and on kp at a hum."""
LEAST_MS, SLOWEST = 1.15, 0.75
"""The least Ms that a further proposal is made for, and its least change at a time."""
HOMED_WHERE_IT_STANDS = (35, 37)
"""Homing methods of CiA 402 that take the present position for home."""


class TuneStoppedError(TuneError):
    """A signal has ended the tuning; the axes were brought to rest."""

    def __init__(self, name: str) -> None:
        super().__init__(f"stopped by {name}; nothing was changed")
        self.exit_status = exit_status_after(name)


class _RunFailedError(TuneError):
    """A run that came to no good end."""


class ProvedSetting(NamedTuple):
    """A setting on the measured plant, and what it has shown."""

    params: AxisParams
    plant: Plant
    margins: Margins
    compliance_m_n: float
    trial: StepAndMove | None
    """None: the machine was not moved with it, or the run did not come to its end."""
    traces: Traces | None
    remark: str
    """Why there is no trial, else ""."""


class TuneResult(NamedTuple):
    """Everything that a report shows."""

    machine: str
    axis: str
    ms: float
    plan: Plan
    response: FrequencyResponse
    model: ModalModel
    before: ProvedSetting
    after: ProvedSetting
    verified: FrequencyResponse
    """Measured with the proposed values."""
    measured_ms: float
    proposal: Proposal
    sections: Sections
    notes: tuple[str, ...]

    @property
    def proved(self) -> bool:
        """The proposal has kept what it promised."""
        trial = self.after.trial
        return trial is not None and not trial.hums and self.measured_ms <= self.ms * MS_TOLERANCE


class TuneRun:
    """Tunes one axis. `tell` is given a line about each stage."""

    def __init__(
        self,
        machine: MachineConfig,
        axis: str,
        bus: str,
        pacing: Pacing,
        out: Path,
        *,
        ms: float,
        force_n: float | None,
        show: Callable[[Progress], None],
        tell: Callable[[str], None],
    ) -> None:
        self._machine, self._axis, self._bus, self._pacing, self._out = machine, axis, bus, pacing, out
        self._ms, self._force_n, self._show, self._tell = ms, force_n, show, tell
        self._moved_m = dict.fromkeys(machine.axes, 0.0)
        """How far home has moved since the first run, where each run takes the present position for home."""
        self._notes: list[str] = []
        if problem := objection(machine, axis):
            raise TuneError(problem)

    async def run(self) -> TuneResult:
        """Measure, propose, prove. Raises TuneError."""
        axis = self._axis
        plan, response = await self._measured()
        model = self._fitted(response)
        params = axis_params(self._machine, axis)
        before = await self._before(params, model, response)
        wanted, largest_kp_1_s = self._ms, math.inf
        for attempt in range(ATTEMPTS):
            proposal = self._proposed(params, model, response, wanted, largest_kp_1_s)
            sections = sections_of(
                proposal, has_notch=self._machine.axes[axis].section(NotchSettings) is not None
            )
            tuned = with_sections(self._machine, axis, sections)
            verified, trial, traces = await self._proved(tuned, plan)
            measured_ms = float(np.max(np.abs(verified.sensitivity)))
            self._tell(f"measured with it: Ms {measured_ms:.2f}")
            too_high = measured_ms > self._ms * MS_TOLERANCE
            if not (too_high or trial.hums) or attempt == ATTEMPTS - 1:
                break
            if too_high:
                wanted = max(LEAST_MS, wanted * max(SLOWEST, 0.98 * self._ms / measured_ms))
                self._note(
                    f"measured Ms {measured_ms:.2f} is above {self._ms:g}: proposed anew for {wanted:.2f}"
                )
            if trial.hums:
                largest_kp_1_s = SOFTER_KP * proposal.kp_1_s
                self._note(f"at rest the axis hums: proposed anew with kp at most {largest_kp_1_s:.3g} 1/s")
        plant, margins, compliance_m_n = judged(proposal.params, model, response)
        after = ProvedSetting(proposal.params, plant, margins, compliance_m_n, trial, traces, "")
        return TuneResult(
            self._machine.machine.name,
            axis,
            self._ms,
            plan,
            response,
            model,
            before,
            after,
            verified,
            measured_ms,
            proposal,
            sections,
            tuple(self._notes),
        )

    async def _measured(self) -> tuple[Plan, FrequencyResponse]:
        """The response, measured with the first gains with which the axis stands still."""
        config = self._machine.axes[self._axis]
        force_n = amplitude.probe_n(config) if self._force_n is None else self._force_n
        problem = ""
        for kp, kv, ki in SOFTNESS:
            control = config.control
            values = {
                "feedback": "motor",  # the loop on the scale may be what does not stand still
                "kp_1_s": kp * control.kp_1_s,
                "ki_1_s2": 0.0,
                "kv_n_s_m": kv * control.kv_n_s_m,
                "ki_n_m": ki * control.ki_n_m,
            }
            machine = with_sections(self._machine, self._axis, {"control": values})
            self._tell(
                f"axis {self._axis}: measuring with kp {kp * control.kp_1_s:.3g} 1/s, kv "
                f"{kv * control.kv_n_s_m:.3g} N s/m, ki {ki * control.ki_n_m:.3g} N/m, on the motor"
            )
            try:
                plan, probe, seen = await self._travelled(machine, force_n, PROBE_PERIODS)
                if self._force_n is None:
                    stronger_n = amplitude.amplitude_n(config, plan, seen)
                    plan, probe, _ = await self._travelled(machine, stronger_n, PERIODS)
                else:
                    plan, probe, _ = await self._travelled(machine, force_n, PERIODS)
            except _RunFailedError as error:
                problem = str(error)
                self._note(f"{problem}; measured again with softer gains")
                continue
            return plan, probe
        raise TuneError(f"axis {self._axis} cannot be measured, with softer gains either: {problem}")

    async def _travelled(
        self, machine: MachineConfig, force_n: float, periods: int
    ) -> tuple[Plan, FrequencyResponse, measurement.AxisReaction]:
        """The travels with this amplitude, and what they show."""
        machine = self._here(machine)
        plan = measurement.plan_measurement(machine, self._axis, force_n, periods)
        folder = self._out / "excitation"
        recording = await self._recorded(
            machine, measurement.measuring_steps(plan, machine, folder), "measure"
        )
        rest_n = recording.segment("rest")[f"{self._axis}.force_command_n"]
        rest_n = rest_n[len(rest_n) // 2 :]
        if float(np.std(rest_n)) > HUM_SHARE * machine.axes[self._axis].limits.force_n:
            raise _RunFailedError(f"axis {self._axis} hums at rest, {float(np.std(rest_n)):.3g} N RMS")
        travels = measurement.measured_travels(plan, machine, self._segments(recording, plan))
        response = measurement.response_of(plan, machine, travels)
        if float(np.median(response.motor_coherence)) < LEAST_MEDIAN_COHERENCE:
            median = float(np.median(response.motor_coherence))
            self._note(f"with {force_n:.3g} N the coherence is {median:.2f} only (median over the lines)")
        return plan, response, measurement.reaction(plan, machine, travels)

    def _fitted(self, response: FrequencyResponse) -> ModalModel:
        try:
            model = fit_modal_model(response, self._machine.period_s)
        except ValueError as error:
            raise TuneError(f"axis {self._axis}: {error}; try --force-n") from None
        self._tell(
            f"plant: {model.mass_kg:.4g} kg, delay {1e3 * (model.delay_s + self._machine.period_s):.2f} ms"
        )
        return model

    async def _before(
        self, params: AxisParams, model: ModalModel, response: FrequencyResponse
    ) -> ProvedSetting:
        """The present setting on the measured plant, and its trial where it may be made."""
        plant, margins, compliance_m_n = judged(params, model, response)
        if not margins.stable:
            remark = "by the measured plant this setting is not stable: the machine was not moved with it"
            self._note(f"before: {remark}")
            return ProvedSetting(params, plant, margins, compliance_m_n, None, None, remark)
        self._tell(f"before: Ms {margins.sensitivity_peak:.2f}; step of force, move and circle")
        try:
            machine = self._here(self._machine)
            steps = proving_steps(machine, self._axis, self._out / "excitation")
            recording = await self._recorded(machine, steps, "before")
        except _RunFailedError as error:
            self._note(f"before: {error}")
            return ProvedSetting(params, plant, margins, compliance_m_n, None, None, str(error))
        trial, traces = evaluate(machine, self._axis, recording.segment)
        return ProvedSetting(params, plant, margins, compliance_m_n, trial, traces, "")

    def _proposed(
        self,
        params: AxisParams,
        model: ModalModel,
        response: FrequencyResponse,
        ms: float,
        largest_kp_1_s: float,
    ) -> Proposal:
        config = self._machine.axes[self._axis]
        motor_m = drive_scaling(config).metre_per_count
        steps = EncoderSteps(
            motor_m, scale_metre_per_count(config) if params.position_loop.scale_feedback else motor_m
        )
        try:
            proposal = propose(params, model, response, ms, steps, largest_kp_1_s=largest_kp_1_s)
        except ValueError as error:
            raise TuneError(f"axis {self._axis}: {error}") from None
        notched = "" if proposal.notch is None else f", notch at {proposal.notch.frequency_hz:g} Hz"
        self._tell(
            f"proposed for Ms {ms:.3g}: kp {proposal.kp_1_s:g} 1/s, kv {proposal.kv_n_s_m:g} N s/m, "
            f"ki {proposal.ki_n_m:g} N/m{notched}"
        )
        return proposal

    async def _proved(
        self, tuned: MachineConfig, plan: Plan
    ) -> tuple[FrequencyResponse, StepAndMove, Traces]:
        """Measured again with the proposed values, and their trial."""
        machine = self._here(tuned)
        folder = self._out / "excitation"
        again = measurement.plan_measurement(machine, self._axis, plan.amplitude_n, PROBE_PERIODS)
        steps = measurement.measuring_steps(again, machine, folder)
        steps += proving_steps(machine, self._axis, folder)
        try:
            recording = await self._recorded(machine, steps, "after")
        except _RunFailedError as error:
            raise TuneError(f"with the proposed values {error}; nothing was changed") from None
        travels = measurement.measured_travels(again, machine, self._segments(recording, again))
        verified = measurement.response_of(again, machine, travels)
        return verified, *evaluate(machine, self._axis, recording.segment)

    async def _recorded(self, machine: MachineConfig, steps: list[dict[str, Any]], name: str) -> Recording:
        """Run a program and load its recording. Raises TuneError."""
        stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%S.%f")
        directory = self._out / "recordings" / f"{name}-{stamp}"
        steps = [*steps, *self._way_back(steps)]
        program = ProgramConfig.model_validate({"source": self._out / f"{name}.toml", "step": steps})
        report = await run_machine(
            machine, program, self._bus, self._pacing, directory, self._show, compensation="off"
        )
        recording = load_recording(directory) if report.cycles else None
        if recording is not None:
            self._keep_home(recording)
        if report.signal:
            raise TuneStoppedError(report.signal)
        if report.failed or not report.completed or recording is None:
            raise _RunFailedError(f"the run ended early: {report.reason}")
        return recording

    def _way_back(self, steps: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """To where the run has begun, of the axes whose home that is."""
        moved = {name for step in steps for name in (*step.get("to_mm", {}), *step.get("axes", ()))}
        homes = {
            name: -self._moved_m[name] / MM
            for name in self._machine.axes
            if name in moved and self._machine.axes[name].homing_method in HOMED_WHERE_IT_STANDS
        }
        if not homes:
            return []
        feed = 12.0 * min(self._machine.axes[name].limits.velocity_mm_s for name in homes)
        return [{"kind": "move", "label": "back", "to_mm": homes, "feed_mm_min": feed}]

    def _keep_home(self, recording: Recording) -> None:
        """Note where the axes stand: the next run may call that home."""
        for name, config in self._machine.axes.items():
            position_m = recording.columns[f"{name}.motor_position_m"]
            known = position_m[np.isfinite(position_m)]
            if config.homing_method in HOMED_WHERE_IT_STANDS and len(known):
                self._moved_m[name] += float(known[-1])

    def _here(self, machine: MachineConfig) -> MachineConfig:
        """The machine with its limits as they are from the home of the next run."""
        axes = {}
        for name, config in machine.axes.items():
            shifted = [edge - self._moved_m[name] / MM for edge in config.limits.position_mm]
            limits = config.limits.model_copy(update={"position_mm": shifted})
            axes[name] = config.model_copy(update={"limits": limits})
        return machine.model_copy(update={"axes": axes})

    def _segments(self, recording: Recording, plan: Plan) -> list[dict[str, Any]]:
        return [recording.segment(measurement.travel_label(k)) for k in range(len(plan.travels))]

    def _note(self, text: str) -> None:
        self._notes.append(text)
        self._tell(text)


def objection(machine: MachineConfig, axis: str) -> str:
    """Why this axis cannot be tuned, or ""."""
    if axis not in machine.axes:
        return f"{machine.machine.name} has no axis {axis}, only {', '.join(machine.axes)}"
    config = machine.axes[axis]
    if config.mode != "cst":
        return f"axis {axis}: mode {config.mode}; tune sets the velocity loop, which is here in mode cst only"
    for kind in (FuzzyPdSettings, DisturbanceObserverSettings):
        if config.acts(kind):
            return f"axis {axis}: {kind.__name__.removesuffix('Settings')} acts; switch it off while you tune"
    return ""
