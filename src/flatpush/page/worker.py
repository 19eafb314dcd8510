"""The process that plans, so that nothing a page asks for keeps the server waiting.

Messages in: (client, number, kind, value). Messages out: (client, kind, JSON of the answer with its number); client 0
is every client. What only the first plan needs is imported before it, and everything else when it is asked for.
"""

import json
import pickle
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from .. import compiling
from ..errors import FlatpushError, InputError

if TYPE_CHECKING:
    from ..problem import Plan
    from .by_hand import ByHand
    from .feedback import Followed
    from .live import LivePlanner

PAUSE = 0.06  # without a newer request, after which better plans are sought [s]
PATIENCE = 0.4  # for a first plan, after which a newer request comes first [s]
SCENES = "plan", "drag"  # kinds of requests for a plan: while something is dragged a sketch of it comes first
Request = tuple[int, int, str, Mapping[str, object]]
Answer = Mapping[str, object]


class Superseded(Exception):
    """A newer request has come."""


@dataclass
class _Job:
    client: int
    number: int
    kind: str
    answers: Iterator[Answer]


def work(requests: Connection, other: Connection | None = None) -> None:
    """Answers requests until the other end is closed, which a process that was forked holds too."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server ends, and with it the connection
    compiling.unheard()
    if other is not None:
        other.close()
    try:
        _Worker(requests).run()
    except (EOFError, OSError):
        return


class _Worker:
    def __init__(self, requests: Connection) -> None:
        self._requests = requests
        self._silence = compiling.listen(self._tell_compiling)  # kernels are compiled where they are imported
        self._new: dict[tuple[int, str], Request] = {}  # the newest of each client and kind
        self._plan: dict[int, Plan] = {}  # the last that was solved
        self._followed: dict[int, Followed] = {}
        self._going_on: dict[tuple[int, str], _Job] = {}
        self._waiting = set[int]()  # clients that have no answer yet
        self._ready = False  # whether what is asked for later was imported

    @cached_property
    def _planner(self) -> "LivePlanner":
        from .live import LivePlanner

        return LivePlanner()

    @cached_property
    def _hand(self) -> "ByHand":
        from .by_hand import ByHand

        return ByHand()

    def run(self) -> None:
        """Until the other end is closed, which raises EOFError or OSError."""
        try:
            while True:
                self._serve()
        finally:
            self._silence()

    def _serve(self) -> None:
        if not self._new:
            self._take(PAUSE if self._going_on or not self._ready else None)
        if self._new:
            self._begin(self._new.pop(next(iter(self._new))))
        elif self._going_on:
            self._go_on(next(reversed(self._going_on.values())))
        else:
            self._ready = True
            _ = self._hand  # the first push by hand does not wait for its kernels

    def _take(self, wait: float | None) -> None:
        """Takes what has come, after waiting for it so long [s], or until something comes."""
        if self._requests.poll(wait):
            while True:
                request: Request = self._requests.recv()
                self._new[request[0], "plan" if request[2] in SCENES else request[2]] = request
                if not self._requests.poll(0):
                    return

    def _begin(self, request: Request) -> None:
        client, number, kind, value = request
        if kind == "left":
            self._followed.pop(client, None)
            self._plan.pop(client, None)
            for job in ("plan", "runs"):
                self._going_on.pop((client, job), None)
            return
        if kind in ("open", "keep"):
            self._open(value) if kind == "open" else self._keep(value)
            return
        if kind == "runs":
            self._end_search(client)
            self._going_on[client, kind] = _Job(client, number, kind, self._runs(client, value))
            return
        if kind not in SCENES:
            self._tell(client, number, self._answer(client, kind, value))
            return
        for job in ("plan", "runs"):
            self._going_on.pop((client, job), None)
        self._waiting.add(client)
        began = time.perf_counter()

        def hurry(*_: float) -> None:
            """Between two rounds of a search: a newer request comes first."""
            if client not in self._waiting or time.perf_counter() - began > PATIENCE:
                self._take(0)
                if self._new:
                    raise Superseded

        self._step(_Job(client, number, "plan", self._plans(client, value, hurry, kind == "drag")))

    def _tell(self, client: int, number: int, answer: Answer) -> None:
        text = json.dumps({**answer, "number": number}, separators=(",", ":"), ensure_ascii=False)
        self._requests.send((client, answer["kind"], text))

    def _open(self, value: Mapping[str, object]) -> None:
        """Reads what the page shows first, tells it, and plans it before a page has asked for it."""
        from .opened import opened
        from .vocabulary import vocabulary

        try:
            found = opened(value["file"], value["of"])  # type: ignore[arg-type]
        except (FlatpushError, OSError):
            self._requests.send((0, "unreadable", ""))
            return
        plan = None if found.plan is None else pickle.dumps(found.plan)
        self._requests.send((0, "opened", (found.scene, plan, found.runs, vocabulary())))
        if plan is not None:
            self._keep({"document": found.scene, "plan": plan})

        def hurry(*_: float) -> None:
            self._take(0)
            if self._new:
                raise Superseded

        try:
            next(self._plans(0, found.scene, hurry, False), None)
        except Superseded:
            return

    def _keep(self, value: Mapping[str, object]) -> None:
        document, plan = value["document"], value["plan"]
        assert isinstance(document, Mapping)
        assert isinstance(plan, bytes)
        self._planner.keep(document, pickle.loads(plan))

    def _answer(self, client: int, kind: str, value: Mapping[str, object]) -> Answer:
        """The answer to what is done at once."""
        from .files import read_dropped, saved
        from .in_mm import scene_in_mm

        try:
            match kind:
                case "hand":
                    return self._hand.step(value)
                case "mechanics":
                    return self._mechanics(client, value)
                case "follow":
                    return self._follow(client, value)
                case "on":
                    if client not in self._followed:
                        raise InputError("nothing is followed")
                    return self._followed[client].on(value)
                case "save":
                    return saved(value, self._plan.get(client))
            answer, plan = read_dropped(value)
            if plan is not None:
                self._planner.keep(scene_in_mm(plan.scene), plan)
            return answer
        except FlatpushError as error:
            return {"kind": "refused" if kind in ("follow", "on") else "error", "reason": str(error)}

    def _shown(self, client: int) -> "Plan":
        if client not in self._plan:
            raise InputError("there is no plan yet")
        return self._plan[client]

    def _follow(self, client: int, value: Mapping[str, object]) -> Answer:
        from .feedback import Followed

        plan = self._shown(client)
        self._end_search(client)
        self._followed[client] = Followed(plan, value)
        return {"kind": "follows"}

    def _runs(self, client: int, value: Mapping[str, object]) -> Iterator[Answer]:
        from .many_runs import many_runs

        try:
            yield from many_runs(self._shown(client), value)
        except FlatpushError as error:
            yield {"kind": "refused", "reason": str(error)}

    def _end_search(self, client: int) -> None:
        """What is tried is the plan that is shown: no better one is sought meanwhile."""
        job = self._going_on.pop((client, "plan"), None)
        if job is not None:
            self._tell(client, job.number, {"kind": "done"})

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
            self._going_on.pop((job.client, job.kind), None)
            self._tell(job.client, job.number, {"kind": "superseded"})
            return False
        if job.kind == "plan":
            self._waiting.discard(job.client)
        if answer is None:
            self._going_on.pop((job.client, job.kind), None)
            if job.kind == "plan":
                self._tell(job.client, job.number, {"kind": "done"})
            return False
        self._tell(job.client, job.number, answer)
        self._going_on[job.client, job.kind] = job
        return True

    def _plans(
        self, client: int, document: Mapping[str, object], hurry: Callable[..., None], sketched: bool
    ) -> Iterator[Answer]:
        from .in_mm import refuse_files
        from .picture import picture
        from .sketch import Sketch

        began = compiling.clock()
        try:
            refuse_files(document)
            kept = self._planner.kept(document)
            if kept is not None:
                self._plan[client] = kept
                from ..simulation import verify

                shown = {"kind": "plan", **picture(kept), "planning_time": None}
                yield {**shown, "stored": "stored"}
                known = () if kept.certificate is None else kept.certificate.warnings
                failed = [f"it does not hold: {claim.name}" for claim in verify(kept).failed]
                said = "stored, fails verification" if failed else "stored and verified"
                yield {**shown, "stored": said, "warnings": [*known, *failed]}
                return
            for plan, options in self._planner.answers(document, hurry, sketched):
                spent = compiling.clock() - began
                if isinstance(plan, Sketch):
                    shown = plan.picture()
                else:
                    shown = picture(plan, options)
                    if plan.status == "solved":
                        self._plan[client] = plan
                yield {"kind": "plan", **shown, "planning_time": spent}
        except Superseded:
            raise
        except FlatpushError as error:
            yield {"kind": "plan", "status": "refused", "reason": str(error)}
        except Exception as error:  # a mistake of ours: the page lives on, and says it
            traceback.print_exc()
            yield {"kind": "plan", "status": "refused", "reason": f"the planner failed: {error!r}"}

    def _mechanics(self, client: int, value: Mapping[str, object]) -> Answer:
        from ..problem import PushSegment
        from .in_mm import refuse_files
        from .mechanics import mechanics
        from .values import scene_of, whole_of

        scene, push, number = scene_of(value), value.get("push"), whole_of(value, "segment", 0, 10**6)
        if not isinstance(push, str):
            raise InputError("the name of a push is needed", key="push", value=push)
        refuse_files(scene)
        moves = self._plan[client].on_table if client in self._plan else ()
        chosen = moves[number] if number < len(moves) else None
        arcs = chosen.arcs if isinstance(chosen, PushSegment) and chosen.push == push else ()
        return {**mechanics(self._planner.listed(scene), push, arcs), "segment": number}

    def _tell_compiling(self, work: compiling.Work) -> None:
        told = {"what": work.kernel, "done": work.done, "of": work.of, "over": work.over}
        self._tell(0, 0, {"kind": "compiling", **told})
