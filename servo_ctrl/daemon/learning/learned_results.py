"""The learned results of a machine: pulse, screw and waveform of each axis, and their stores."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from servo_ctrl.axis.servo import AxisServo
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.daemon.learning.axis_learning import AxisLearning
from servo_ctrl.daemon.learning.learned_compensation import Compensation, LearnedCompensation, loaded
from servo_ctrl.daemon.learning.pulse_compensation import AxisCompensation, Functions, tabulated
from servo_ctrl.daemon.learning.pulse_learning import PulseLearning
from servo_ctrl.daemon.learning.screw_compensation import ScrewCompensation
from servo_ctrl.daemon.learning.screw_learning import ScrewLearning
from servo_ctrl.daemon.learning.waveform_compensation import WaveformCompensation
from servo_ctrl.daemon.learning.waveform_learning import WaveformLearning
from servo_ctrl.daemon.set_points.motion_plan import MotionPlan
from servo_ctrl.learned.store import LearnedStore, ScrewStore, WaveformStore
from servo_ctrl.learning.screw import LEARNER as SCREW
from servo_ctrl.learning.waveform_stroke import LEARNER as WAVEFORM


class LearnedResults:
    """Loads the stored versions from `directory` and puts them into use. Raises CompensationError.

    `pulses`, `screws` and `waveforms` are by axis, in machine order.
    """

    def __init__(
        self, config: MachineConfig, servos: Sequence[AxisServo], directory: Path, wanted: Compensation
    ) -> None:
        self._config = config
        self.pulse_store, self.screw_store = LearnedStore(directory, config), ScrewStore(directory, config)
        self.waveform_store = WaveformStore(directory, config)

        def functions(axis: str) -> Functions | None:
            return tabulated(self.pulse_store.active(axis))

        self.pulses = loaded(AxisCompensation, config, servos, functions, wanted)
        self.screws = loaded(ScrewCompensation, config, servos, self.screw_store.active, wanted)
        self.waveforms = loaded(WaveformCompensation, config, servos, self.waveform_store.active, wanted)

    @property
    def problems(self) -> list[str]:
        """Why stored versions are not used."""
        axes: list[LearnedCompensation[Any]] = [*self.pulses.values(), *self.screws.values()]
        axes += self.waveforms.values()
        return [axis.problem for axis in axes if axis.problem]

    def learning_of(self, axis: str, learner: str, motion: MotionPlan) -> AxisLearning:
        """Return the learning of an axis by this learner."""
        if learner == SCREW:
            return ScrewLearning(self._config, self.screw_store, self.screws[axis], motion)
        pulse, waveform = self.pulses[axis], self.waveforms[axis]
        if learner == WAVEFORM:
            return WaveformLearning(self._config, self.waveform_store, waveform, pulse, motion)
        return PulseLearning(self._config, learner, self.pulse_store, pulse, motion, waveform=waveform)
