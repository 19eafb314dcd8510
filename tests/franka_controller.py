"""franky-sim on an address, slower than real time so that shared machines keep up: a process of its own for tests."""

import argparse
import json
import select
import sys
from itertools import count

from franky_sim import SimulationServer
from franky_sim.mujoco_simulator import MujocoSimulator


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--host", required=True)
    parser.add_argument("--joints", type=float, nargs=7, required=True)
    parser.add_argument("--slow", type=float, default=3.0, help="times slower than real time")
    asked = parser.parse_args()
    with MujocoSimulator(enable_visualization=False) as sim:
        robot = sim.add_robot(initial_q=asked.joints)
        with SimulationServer(sim, hostname_candidates=[asked.host]) as server:
            print(json.dumps({"host": robot.hostname}), flush=True)
            for step in count():
                if select.select([sys.stdin], [], [], 0)[0]:
                    if not sys.stdin.readline():
                        return
                    state = robot.state
                    print(json.dumps({"step": step, "q": list(state.q), "dq": list(state.dq)}), flush=True)
                server.run_once(asked.slow)


if __name__ == "__main__":
    main()
