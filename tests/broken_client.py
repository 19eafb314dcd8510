"""This side of a robot's network, broken off while it runs a plan: a process of its own, started by tests.

The module of a robot's tests, with its `robot_at`, where that is, a plan, the package's folder and the table in the
robot's base are its arguments. In a line for each run on standard input come a phase and what happens in it: "killed",
"frozen", or "late", and how late [s]. It answers with the phase when that is about to happen, and with the outcome of a
run that was late. Each run is a child, so that the package is imported once; what is frozen is killed before the next.
"""

import os
import signal
import sys
import time
from functools import partial
from importlib import import_module


def begun(robot_at, plan, phase, how, late):
    """A child that runs the plan."""
    from flatpush.execution import run
    from tests.broken_off import in_phase

    def act():
        print(phase, flush=True)
        if how == "late":
            time.sleep(late)
        else:
            os.kill(os.getpid(), signal.SIGKILL if how == "killed" else signal.SIGSTOP)

    child = os.fork()
    if child:
        return child
    try:
        with robot_at() as robot:
            ended = run(plan, robot, told=in_phase(phase, act)[0])
        print(ended.outcome, flush=True)
    finally:
        os._exit(0)


def main():
    module, where, plan, folder, *base = sys.argv[1:]
    sys.path.insert(0, folder)
    import flatpush as fp

    loaded, child = fp.load_plan(plan), None
    more = {"base": tuple(map(float, base))} if base else {}
    robot_at = partial(import_module(module).robot_at, int(where) if where.isdigit() else where, **more)
    for line in sys.stdin:
        if child is not None:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        phase, how, late = line.split()
        child = begun(robot_at, loaded, phase, how, float(late))


if __name__ == "__main__":
    main()
