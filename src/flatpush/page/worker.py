"""The process that plans, so that nothing a page asks for keeps the server waiting.

Messages in: (client, number, kind, value). Messages out: (client, number, mapping); number 0 is for every client.
"""

import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection

from .. import compiling
from ..errors import FlatpushError, InputError
from ..problem import Plan

PAUSE = 0.06  # without a newer request, after which better plans are sought [s]
PATIENCE = 0.4  # for a first plan, after which a newer request comes first [s]
Request = tuple[int, int, str, Mapping[str, object]]
Answer = Mapping[str, object]


class Superseded(Exception):
    """A newer request has come."""


@dataclass
class _Job:
    client: int
    number: int
    answers: Iterator[Answer]


def work(requests: Connection) -> None:
    """Answers requests until the other end is closed."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends, and with it the connection
    try:
        _Worker(requests).run()
    except (EOFError, OSError):
        return


class _Worker:
    def __init__(self, requests: Connection) -> None:
        self._requests = requests
        self._new: dict[tuple[int, str], Request] = {}  # the newest of each client and kind
        self._plan: dict[int, Plan] = {}  # the last that was solved
        self._going_on: dict[int, _Job] = {}
        self._waiting = set[int]()  # clients that have no answer yet
        from .by_hand import ByHand
        from .live import LivePlanner

        self._planner, self._hand = LivePlanner(), ByHand()

    def run(self) -> None:
        """Until the other end is closed, which raises EOFError or OSError."""
        silence = compiling.listen(self._tell_compiling)
        try:
            while True:
                self._serve()
        finally:
            silence()

    def _serve(self) -> None:
        if not self._new:
            self._take(None if not self._going_on else PAUSE)
        if self._new:
            self._begin(self._new.pop(next(iter(self._new))))
        elif self._going_on:
            self._go_on(next(iter(self._going_on.values())))

    def _take(self, wait: float | None) -> None:
        """Takes what has come, after waiting for it so long [s], or until something comes."""
        if self._requests.poll(wait):
            while True:
                request: Request = self._requests.recv()
                self._new[request[0], request[2]] = request
                if not self._requests.poll(0):
                    return

    def _begin(self, request: Request) -> None:
        client, number, kind, value = request
        if kind == "left":
            for known in (self._going_on, self._plan):
                known.pop(client, None)
            return
        if kind != "plan":
            from .files import read_dropped, saved

            answer: Answer
            try:
                if kind == "hand":
                    answer = self._hand.step(value)
                elif kind == "mechanics":
                    answer = self._mechanics(value)
                else:
                    answer = read_dropped(value) if kind == "file" else saved(value, self._plan.get(client))
            except FlatpushError as error:
                answer = {"kind": "error", "reason": str(error)}
            self._requests.send((client, number, answer))
            return
        self._going_on.pop(client, None)
        self._waiting.add(client)
        began = time.perf_counter()

        def hurry(*_: float) -> None:
            """Between two rounds of a search: a newer request comes first."""
            if client not in self._waiting or time.perf_counter() - began > PATIENCE:
                self._take(0)
                if self._new:
                    raise Superseded

        self._step(_Job(client, number, self._plans(client, value, hurry)))

    def _go_on(self, job: _Job) -> None:
        while self._step(job):
            self._take(0)
            if self._new:
                return

    def _step(self, job: _Job) -> bool:
        """One more answer of a job; whether there may be others."""
        try:
            answer = next(job.answers, None)
        except Superseded:
            self._waiting.discard(job.client)
            self._going_on.pop(job.client, None)
            self._requests.send((job.client, job.number, {"kind": "superseded"}))
            return False
        self._waiting.discard(job.client)
        if answer is None:
            self._going_on.pop(job.client, None)
            self._requests.send((job.client, job.number, {"kind": "done"}))
            return False
        self._requests.send((job.client, job.number, answer))
        self._going_on[job.client] = job
        return True

    def _plans(
        self, client: int, document: Mapping[str, object], hurry: Callable[..., None]
    ) -> Iterator[Answer]:
        from .in_mm import refuse_files
        from .picture import picture

        began = compiling.clock()
        try:
            refuse_files(document)
            for plan, options in self._planner.answers(document, hurry):
                spent = compiling.clock() - began
                if plan.status == "solved":
                    self._plan[client] = plan
                yield {"kind": "plan", **picture(plan, options), "planning_time": spent}
        except Superseded:
            raise
        except FlatpushError as error:
            yield {"kind": "plan", "status": "refused", "reason": str(error)}
        except Exception as error:  # a mistake of ours: the page lives on, and says it
            traceback.print_exc()
            yield {"kind": "plan", "status": "refused", "reason": f"the planner failed: {error!r}"}

    def _mechanics(self, value: Mapping[str, object]) -> Answer:
        from .in_mm import refuse_files
        from .mechanics import mechanics

        scene, push = value.get("scene"), value.get("push")
        if not isinstance(scene, dict) or not isinstance(push, str):
            raise InputError("a scene and the name of a push are needed")
        refuse_files(scene)
        return mechanics(self._planner.listed(scene), push)

    def _tell_compiling(self, work: compiling.Work) -> None:
        self._requests.send(
            (
                0,
                0,
                {
                    "kind": "compiling",
                    "what": work.kernel,
                    "done": work.done,
                    "of": work.of,
                    "over": work.over,
                },
            )
        )
