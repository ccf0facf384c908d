"""`servo-ctrl compile`: compile the kernels of a machine before its first start."""

from servo_ctrl.cli.options import MachineOption


def compile_kernels(machine: MachineOption) -> None:
    """Compile the kernels of a machine into the cache on the disk; its next start loads them in a second.

    Needs no bus. `make setup` does it for the X-Y table, an image for its machine.
    """
    from servo_ctrl.canopen.plan import plan_machine
    from servo_ctrl.config.kernel_params import motion_limits
    from servo_ctrl.config.load import load_machine
    from servo_ctrl.daemon.run.assemble import build_axes
    from servo_ctrl.motion.path.warm_up import warm_up

    config = load_machine(machine)
    build_axes(config, plan_machine(config))
    warm_up(motion_limits(config), config.period_s)
