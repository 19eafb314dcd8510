"""What tests of the live page say to it: scenes, files and requests."""

import base64
import json
from multiprocessing import Pipe
from pathlib import Path
from threading import Thread

import pytest

from flatpush.page import worker
from flatpush.page.files import read_dropped
from tests.waiting import heard, until

EXAMPLES = Path(__file__).parents[1] / "examples"

SCENE = """
flatpush: scene/1
units: {length: mm, angle: deg}
object: {outline: [[20, -10], [20, 19], [-39, -10]], friction: 0.3}
pusher: {fingers: 2, spacing: 18}
pushes:
  - {name: long edge, at: [0, -10]}
  - {name: short edge, at: [20, 4.75]}
  - {name: hypotenuse, edge: 1, along: 0.42}
start: [-120, 60, -60]
goal: [0, 0, 0]
planning: {model: ellipsoid, two_finger: middle, switch_cost: 2, iterations: 1}
"""

CAMERA = {"controller": "path", "delay": 0.1, "frames": 30, "noise": [0.3, 0.3], "learn": False, "seed": 3}


def dropped(name, content, **more):
    answer, _ = read_dropped({"name": name, "data": base64.b64encode(content).decode(), **more})
    return answer


def told(requests, over):
    """What the worker tells, with its client and number, of requests that wait when it begins, until that is `over`."""
    here, there = Pipe()
    for request in requests:
        here.send(request)

    def run():
        with pytest.raises((EOFError, OSError)):
            worker._Worker(there).run()

    thread = Thread(target=run)
    thread.start()
    answers = []

    def hear():
        client, kind, text = heard(here)
        answer = json.loads(text)
        assert answer["kind"] == kind
        answers.append((client, answer.pop("number"), answer))
        return over(answers)

    until(hear, pause=0)
    here.close()
    thread.join(10)
    assert not thread.is_alive()
    return answers


def answers_of(requests, last):
    """What the worker answers to requests of client 1, until one of a kind has come."""
    answers = told(requests, lambda told: told[-1][0] == 1 and told[-1][2]["kind"] == last)
    return [{**answer, "number": number} for client, number, answer in answers if client == 1]
