"""What clearance and search cost, by the number of obstacles and of poses: python benchmarks/obstacle_cost.py [FIGURE].

A triangle with two fingers on a table of 1 × 1 m on which boxes, a fifth of it together, stand at random. Poses and
edges (50 mm of a turn or of a straight way) are drawn where they are free or not, and decided one by one by a compiled
loop; then a lattice of one level is grown among boxes, to 100,000 poses. CPU time of one thread. With a name it draws
the figure of docs/obstacles.md.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numba as nb
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from flatpush.geometry import Outline, transform
from flatpush.geometry.collision import Body, World
from flatpush.geometry.collision.kernels import pose_gap, twist_gap
from flatpush.planning.obstacles.lattice import Lattice, Level, Reach
from test_obstacles import CORNERS, boxes

OBSTACLES = 1, 3, 10, 30, 100, 300, 1000
POSES = 1_000, 3_000, 10_000, 30_000, 100_000
DRAWN, TIMES = 20_000, 5
EDGE = 0.05  # length of an edge [m]
TAKEN = 0.2  # of the table
SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


@nb.njit
def poses_free(W, body, poses):
    count = 0
    for i in range(len(poses)):
        count += pose_gap(W, body, poses[i], 0.0, 0.0) >= 0.0
    return count


@nb.njit
def edges_free(W, body, poses, steps):
    count = 0
    for i in range(len(poses)):
        count += twist_gap(W, body, poses[i], steps[i], 0.0, 0.0) >= 0.0
    return count


def strewn(count: int) -> World:
    """So many boxes at random places and angles."""
    rng, side = np.random.default_rng(count), np.sqrt(TAKEN / count)
    at = np.column_stack([rng.uniform(0, 1, (count, 2)), rng.uniform(0, np.pi, count)])
    return World.of((0, 0, 1, 1), [transform(pose, side * SQUARE) for pose in at])


def best_time(run: Callable[[], int]) -> tuple[float, int]:
    """The least of some times [s], and what came out."""
    found, spent = run(), []
    for _ in range(TIMES):
        began = time.thread_time()
        run()
        spent.append(time.thread_time() - began)
    return min(spent), found


def checks() -> list[tuple[float, ...]]:
    """Rows: obstacles, µs a pose, µs an edge, free poses, free edges, kB."""
    body = Body.of(Outline.polygon(CORNERS), [(0.022167, 0.01375), (0.022167, -0.00425)], 0.0025)
    body = body.arrays
    rng = np.random.default_rng(0)
    poses = rng.uniform([0.06, 0.06, -np.pi], [0.94, 0.94, np.pi], (DRAWN, 3))
    turns = rng.choice([-1.0, 0.0, 1.0], DRAWN) * EDGE / 0.06
    angles = rng.uniform(-np.pi, np.pi, DRAWN)
    steps = np.column_stack([EDGE * np.cos(angles), EDGE * np.sin(angles), turns])
    rows = []
    for count in OBSTACLES:
        W = strewn(count).arrays
        pose, free = best_time(lambda W=W: poses_free(W, body, poses))
        edge, clear = best_time(lambda W=W: edges_free(W, body, poses, steps))
        size = sum(a.nbytes for a in W if isinstance(a, np.ndarray))
        rows.append((count, 1e6 * pose / DRAWN, 1e6 * edge / DRAWN, free / DRAWN, clear / DRAWN, size / 1e3))
    return rows


def poses() -> list[tuple[float, float, float]]:
    """Rows: poses of a lattice, seconds, MB."""
    asked = boxes()
    reach, rows = Reach(asked), []
    for warm in (True, False):
        # A weight of zero: it spreads evenly and does not run for the goal.
        lattice, spent = (
            Lattice(asked, reach, Level(0.006, 96, 0.009, False, 0.0), np.inf, np.random.default_rng(0)),
            0.0,
        )
        for size in POSES[:1] if warm else POSES:
            while lattice.size < size and not lattice.done:
                began = time.thread_time()
                lattice.advance(100, np.inf)
                spent += time.thread_time() - began
            arrays = lattice.queue[:5]
            rows.append((lattice.size, spent, sum(a.nbytes for a in arrays) / 1e6))
    return rows[1:]


def draw(path: Path, by_obstacles: np.ndarray, by_poses: np.ndarray) -> None:
    """The tables as two drawings with a second scale for memory."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context({"font.size": 9.5, "legend.frameon": False, "svg.hashsalt": "flatpush"}):
        figure = Figure((8.0, 3.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        n, pose, edge, _, _, kilobytes = by_obstacles.T
        m, seconds, megabytes = by_poses.T
        left.set_ylim(0.1, 20)  # room for the legend
        for axes, x, lines, memory, labels in (
            (left, n, {"a pose": pose, "an edge of 50 mm": edge}, kilobytes,
             ("obstacles", "time of a check [µs]", "memory of the scene [kB]")),
            (right, m, {"time": seconds}, megabytes,
             ("poses of the search", "CPU time [s]", "memory of the search [MB]")),
        ):  # fmt: skip
            for (name, y), colour in zip(lines.items(), ("#0072b2", "#d55e00"), strict=False):
                axes.loglog(x, y, "o-", ms=4, lw=1.4, color=colour, label=name)
            other = axes.twinx()
            other.set_ylim(0.5 * min(memory), 5 * max(memory))
            other.loglog(x, memory, "s--", ms=3.5, lw=1.0, color="#777777", label="memory")
            axes.set_xlabel(labels[0])
            axes.set_ylabel(labels[1])
            other.set_ylabel(labels[2])
            handles = [*axes.get_lines(), *other.get_lines()]
            axes.legend(handles, [h.get_label() for h in handles], loc="upper left")
            for axis in (axes.xaxis, axes.yaxis, other.yaxis):
                axis.set_major_formatter("{x:g}")
                axis.set_minor_formatter("")
            axes.grid(True, which="major", lw=0.4, color="#dddddd")
        figure.savefig(path, metadata={"Title": "Cost of clearance and of search", "Date": None})


def main(figure: Path | None) -> None:
    by_obstacles, by_poses = checks(), poses()
    print("obstacles   pose [µs]   edge [µs]   free poses   free edges   memory [kB]")
    for row in by_obstacles:
        print(f"{row[0]:9d} {row[1]:11.2f} {row[2]:11.2f} {row[3]:12.0%} {row[4]:12.0%} {row[5]:13.1f}")
    print("    poses    time [s]   memory [MB]")
    for size, seconds, megabytes in by_poses:
        print(f"{size:9d} {seconds:11.3f} {megabytes:13.2f}")
    if figure is not None:
        draw(figure, np.array(by_obstacles), np.array(by_poses))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
