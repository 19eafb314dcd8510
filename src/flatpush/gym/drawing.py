"""A picture of the table from above, for learners that see pixels."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ..geometry import transform
from ..geometry.pose import Array
from .task import PushTask

SIZE = 96  # pixels on a side
FINER = 3  # how many times larger it is drawn
TABLE, GOAL, THING, OBSTACLE, FINGER = "#ffffff", "#8fd694", "#5b7a99", "#808080", "#2f5cd6"


def drawn(task: PushTask, pose: Array, hand: Array, goal: Array) -> NDArray[np.uint8]:
    """Object, goal, obstacles and fingers, (96, 96, 3): the task's box fills the picture, x to the right, y upwards."""
    low, high = task.box
    room, middle = float(np.max(high - low)), 0.5 * (low + high)
    image = Image.new("RGB", (FINER * SIZE, FINER * SIZE), TABLE)
    pen = ImageDraw.Draw(image)

    def pixels(points: Array) -> Array:
        shares = (points - middle) / room * np.array([1.0, -1.0]) + 0.5
        return FINER * SIZE * shares

    def area(points: Array, colour: str) -> None:
        pen.polygon(pixels(points).ravel().tolist(), fill=colour)

    outline = task.scene.object.outline.polyline()
    for obstacle in task.scene.workspace.obstacles:
        area(obstacle.polyline(), OBSTACLE)
    area(transform(goal, outline), GOAL)
    area(transform(pose, outline), THING)
    radius = max(task.scene.pusher.tip_radius / room * FINER * SIZE, FINER)
    for x, y in pixels(transform(hand, task.fingers)):
        pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=FINGER)
    return np.asarray(image.reduce(FINER))
