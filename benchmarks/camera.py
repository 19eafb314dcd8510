"""How well and how fast a camera sees tags: python benchmarks/camera.py [FRAMES] [CORRUPTED].

A drawn camera of 1280 × 960 pixels over 451 mm, a block with a tag of 30 mm on its top that moves. Printed: root mean
square errors against where the block was drawn, CPU time of a frame, and what passes of frames that are corrupted.
"""

import sys
import time

import numpy as np

from flatpush.geometry import compose, exp, pose_error
from flatpush.geometry.table_camera import TableCamera
from flatpush.vision.synthetic import Spoil, SyntheticCamera
from flatpush.vision.tracker import Tracker
from flatpush.vision.worn import Tag

WIDTH, FOCAL, RATE = 0.451, 1400.0, 30.0
BARREL = (-0.18, 0.05, 0.001, -0.0008, 0.0)
TAG = Tag(3, 0.03, 0.02, np.array([0.003, -0.002, 0.2]))
TOP = np.array([(-0.03, -0.025), (0.03, -0.025), (0.03, 0.025), (-0.03, 0.025)])
# A pose that passes and is off by more than this is false.
FALSE = (0.0015, np.deg2rad(2.0))


def over(lens: tuple[float, ...]) -> TableCamera:
    """A camera that sees the table's width, tilted by 6°."""
    c, s = np.cos(0.1), np.sin(0.1)
    R = np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ np.diag([1.0, -1.0, -1.0])
    height = FOCAL * WIDTH / 1280
    return TableCamera((1280, 960), [FOCAL, FOCAL], [639.5, 479.5], lens, R, [0.0, 0.0, height])


def way(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A start within the picture and a body twist of a push."""
    start = np.array([*rng.uniform(-1, 1, 2) * (0.15, 0.1), rng.uniform(-3, 3)])
    return start, np.array([*rng.uniform(-0.03, 0.03, 2), rng.uniform(-0.6, 0.6)])


def precise(name: str, spoil: Spoil, lens: tuple[float, ...], frames: int) -> None:
    camera, rng = over(lens), np.random.default_rng(0)
    drawn, tracker = SyntheticCamera(camera, {"o": TAG}, {"o": TOP}, spoil=spoil), Tracker(camera, {"o": TAG})
    errors, spent, first = [], [], []
    for _ in range(max(1, frames // 20)):
        state, (pose, twist) = tracker.start(), way(rng)
        for k in range(20):
            picture = drawn.picture({"o": pose}, rng)
            began = time.process_time()
            state, seen = tracker.step(state, picture, k / RATE)
            (spent if k else first).append(time.process_time() - began)
            if "o" in seen.sightings:
                errors.append(pose_error(seen.sightings["o"].pose, pose))
            pose = compose(pose, exp(twist / RATE))
    off = np.array(errors)
    place, turn = np.sqrt(np.mean(np.sum(off[:, :2] ** 2, axis=1))), np.sqrt(np.mean(off[:, 2] ** 2))
    print(
        f"{name}: {len(off)} of {len(spent) + len(first)} frames seen, {1000 * place:.4f} mm and"
        f" {np.rad2deg(turn):.4f}° rms (worst {1000 * np.hypot(*off[:, :2].T).max():.3f} mm,"
        f" {np.rad2deg(np.abs(off[:, 2]).max()):.3f}°); {1000 * np.median(spent):.1f} ms a frame when tracking"
        f" (95 % {1000 * np.percentile(spent, 95):.1f}), {1000 * np.median(first):.0f} ms to find it",
        flush=True,
    )


def corrupted(count: int) -> None:
    """Frames that are covered, blurred, glaring, dark and noisy by chance; a tag of another number in a third of them
    instead of the block's own. In half of them the block is tracked, in the others it is new."""
    camera, rng = over(BARREL), np.random.default_rng(1)
    tracker = Tracker(camera, {"o": TAG})
    passed, false, worst, absent = 0, 0, np.zeros(2), 0
    for k in range(count):
        other = k % 3 == 2
        worn = Tag(int(rng.integers(4, 587)), 0.03, 0.02) if other else TAG
        spoil = Spoil(
            noise=float(rng.uniform(0, 40)), blur=float(rng.choice([0, 1, 2, 4])),
            glare=float(rng.choice([0, 150, 400])),
            covered=float(rng.uniform(0, 0.6)) if rng.random() < 0.8 else 0.0, light=float(rng.uniform(0.15, 1.3)),
            gradient=float(rng.uniform(0, 0.9)),
        )  # fmt: skip
        pose, twist = way(rng)
        state = tracker.start()
        if k % 2:  # three good frames before
            good = SyntheticCamera(camera, {"o": TAG}, {"o": TOP})
            for j in range(3):
                state, _ = tracker.step(state, good.picture({"o": pose}), (j - 3) / RATE)
                pose = compose(pose, exp(twist / RATE))
        picture = SyntheticCamera(camera, {"o": worn}, {"o": TOP}, spoil=spoil).picture({"o": pose}, rng)
        _, seen = tracker.step(state, picture, 0.0)
        if "o" in seen.sightings:
            passed += 1
            off = pose_error(seen.sightings["o"].pose, pose)
            size = np.array([np.hypot(*off[:2]), abs(off[2])])
            wrong = other or size[0] > FALSE[0] or size[1] > FALSE[1]
            false += wrong
            absent += other
            worst = np.maximum(worst, size)
    print(
        f"corrupted: {count} frames, {passed} poses pass, {false} of them false (off by more than"
        f" {1000 * FALSE[0]:g} mm or {np.rad2deg(FALSE[1]):g}°, or of a tag that is not there: {absent});"
        f" the worst that passes is off by {1000 * worst[0]:.3f} mm and {np.rad2deg(worst[1]):.3f}°"
    )


if __name__ == "__main__":
    frames = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    precise("clean", Spoil(), (0.0,) * 5, frames)
    precise("noise 5, blur 1.2 px, lens", Spoil(noise=5, blur=1.2), BARREL, frames)
    precise(
        "noise 10, blur 2 px, lens, light that falls off",
        Spoil(noise=10, blur=2, gradient=0.5),
        BARREL,
        frames,
    )
    corrupted(int(sys.argv[2]) if len(sys.argv) > 2 else 1000)
