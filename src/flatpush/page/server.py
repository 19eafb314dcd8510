"""The server of the page: static files and one WebSocket, for this machine alone unless told otherwise."""

import asyncio
import errno
import json
import multiprocessing
import secrets
import socket
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from importlib.resources import files
from itertools import count
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from ..errors import FlatpushError, InputError, MissingExtra
from .options import Options
from .worker import work

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

    from starlette.applications import Starlette
    from starlette.requests import HTTPConnection, Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

MOST_BYTES = 3_000_000  # of a message
RATE, BURST = 150.0, 300.0  # messages a second that a page may send, and at once
KINDS = "plan", "drag", "file", "save", "hand", "mechanics", "follow", "on", "runs"
TRIES = 30  # ports
TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
_IN_USE = (errno.EADDRINUSE, errno.EACCES)
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline';"
    " base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
Message = Mapping[str, object]


@dataclass(frozen=True)
class Asked:
    """What the page is to show first: a scene, a plan or a log, and the scene or the plan of a log (opened.py)."""

    file: "Path | None" = None
    of: "Path | None" = None


@dataclass(frozen=True, eq=False)
class Shown:
    """What the page shows first, as opened.py has it.

    Attributes:
        plan: pickled, by the process that plans for the one that takes its place: this one needs no part of it.
        words: as vocabulary.py has them.
    """

    scene: Message
    plan: bytes | None = None
    runs: tuple[Message, ...] = ()
    words: Message = field(default_factory=dict)


def serve(asked: Asked, options: Options, told: Callable[[str], None]) -> None:
    """Serves the page until it is interrupted.

    Args:
        asked: what the page shows first.
        options: how it is served.
        told: called with lines for people: the link, and what went otherwise than asked.

    Raises:
        MissingExtra: without the extra `page`.
        InputError: if no port is free, the address is not one of this machine, or what is shown cannot be read.
        KeyboardInterrupt: when it is interrupted.
    """
    planner = Planner(asked)  # first of all: it reads and plans while the server starts
    try:
        _serve(planner, options, told)
    finally:
        planner.close()


def _serve(planner: "Planner", options: Options, told: Callable[[str], None]) -> None:
    try:
        import uvicorn
        from starlette.applications import Starlette as _  # noqa: F401
    except ImportError as error:
        raise MissingExtra('the page needs a web server: pip install "flatpush[page]"') from error
    planner.read()
    listening = _listen(options, told)
    port = listening.getsockname()[1]
    token = secrets.token_urlsafe(16)
    host = f"[{options.host}]" if ":" in options.host else options.host
    link = f"http://{host}:{port}/?token={token}"
    try:
        app = application(planner, token, {host, "localhost"} if _is_local(options.host) else set())
        server = uvicorn.Server(
            uvicorn.Config(
                app,
                log_level="critical",
                ws="websockets-sansio",
                ws_max_size=MOST_BYTES,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=1,
                server_header=False,
                lifespan="on",
            )
        )
        told(f"the page is at {link}")
        if options.browser:
            threading.Thread(target=_open, args=(link, told), daemon=True).start()
        server.run(sockets=[listening])
    finally:
        listening.close()


def application(planner: "Planner", token: str, hosts: set[str]) -> "Starlette":
    """The application; a request shows the token, and its host and its origin are among the given ones (none: any)."""
    from starlette.applications import Starlette
    from starlette.responses import PlainTextResponse, Response
    from starlette.routing import Route, WebSocketRoute

    clients = count(1)

    def at_home(request: "HTTPConnection") -> bool:
        """Whether it asks for this server by its own name: another name that leads here is somebody else's page."""
        name = urlsplit(f"//{request.headers.get('host', '')}")
        return not hosts or _host(name.hostname) in hosts

    async def page(request: "Request") -> "Response":
        if not at_home(request):
            return PlainTextResponse("this server answers to its own address only\n", 403)
        if not secrets.compare_digest(request.query_params.get("token", ""), token):
            return PlainTextResponse("open the link that flatpush view printed: it holds the key\n", 403)
        return _static("index.html")

    async def static(request: "Request") -> "Response":
        return _static(request.path_params["name"]) if at_home(request) else Response(status_code=403)

    async def live(socket: "WebSocket") -> None:
        origin = urlsplit(socket.headers.get("origin", ""))
        same = origin.netloc == socket.headers.get("host", "") and origin.scheme in ("http", "https")
        right = secrets.compare_digest(socket.query_params.get("token", ""), token)
        if not (at_home(socket) and same and right):
            await socket.close(1008)
            return
        await socket.accept()
        await Talk(socket, planner, next(clients)).run()

    @asynccontextmanager
    async def lifespan(_: "Starlette") -> "AsyncIterator[None]":
        planner.attach(asyncio.get_running_loop())
        yield

    routes = [
        Route("/", page),
        Route("/{name}", static),
        WebSocketRoute("/live", live),
    ]
    return Starlette(routes=routes, lifespan=lifespan)


class Planner:
    """The worker process and who waits for its answers, which are texts in JSON."""

    def __init__(self, asked: Asked) -> None:
        self._asked = asked
        self.shown = Shown({})
        self._waiting: dict[int, asyncio.Queue[str]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self.compiling = ""  # what is told while something is being compiled
        # A fork of a process that has no threads and no sockets yet is there at once; later ones are spawned.
        self._start("fork" if sys.platform == "linux" and threading.active_count() == 1 else "spawn")
        self._requests.send((0, 1, "open", {"file": asked.file, "of": asked.of}))

    def _start(self, how: str) -> None:
        self._requests, theirs = multiprocessing.Pipe()
        ends = (theirs, self._requests) if how == "fork" else (theirs,)
        context = multiprocessing.get_context(how)
        self._process = context.Process(target=work, args=ends, daemon=True)  # type: ignore[attr-defined]
        self._process.start()
        theirs.close()

    def read(self) -> None:
        """Waits for what is shown first.

        Raises:
            InputError: if it cannot be read.
            FlatpushError: if the process that reads it ends.
        """
        kind = ""
        while kind != "opened":
            try:
                _, kind, content = self._requests.recv()
            except (EOFError, OSError):
                raise FlatpushError(
                    "the process that plans has ended before it could read the scene"
                ) from None
            if kind == "compiling":
                self._note(content)
            elif kind == "unreadable":
                from .opened import opened

                opened(self._asked.file, self._asked.of)  # tells why, as it told the other process
                raise FlatpushError("the scene could not be read, and now it can; try again")
        self.shown = Shown(*content)

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """From now on answers go to the queues of this loop."""
        self._loop = loop
        threading.Thread(target=self._listen, args=(self._requests,), daemon=True).start()

    def join(self, client: int) -> "asyncio.Queue[str]":
        return self._waiting.setdefault(client, asyncio.Queue())

    def leave(self, client: int) -> None:
        self._waiting.pop(client, None)
        self.ask(client, 1, "left", {})

    def ask(self, client: int, number: int, kind: str, value: Message) -> None:
        """Hands a request, a number of the client's own counting, to the worker."""
        try:
            self._requests.send((client, number, kind, value))
        except OSError:  # it died; whoever asks next has a new one
            self._start("spawn")
            assert self._loop is not None
            self.attach(self._loop)
            if self.shown.plan is not None:
                kept = {"document": self.shown.scene, "plan": self.shown.plan}
                self._requests.send((0, 1, "keep", kept))
            self._requests.send((client, number, kind, value))

    def close(self) -> None:
        self._requests.close()
        self._process.join(0.5)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(1.0)

    def _listen(self, requests: Connection) -> None:
        while True:
            try:
                client, kind, text = requests.recv()
            except (EOFError, OSError):
                client, kind, text = 0, "lost", json.dumps({"kind": "lost", "number": 0})
            if self._loop is None or self._loop.is_closed():
                return
            try:
                self._loop.call_soon_threadsafe(self._give, client, kind, text)
            except RuntimeError:  # the loop has just been closed
                return
            if kind == "lost":
                return

    def _give(self, client: int, kind: str, text: str) -> None:
        if kind == "compiling":
            self._note(text)
        for known, queue in self._waiting.items():
            if client in (0, known):
                queue.put_nowait(text)

    def _note(self, text: str) -> None:
        self.compiling = "" if json.loads(text)["over"] else text


class Talk:
    """One page that is open: its messages are checked here, and answered by the worker."""

    def __init__(self, socket: "WebSocket", planner: Planner, client: int) -> None:
        self._socket, self._planner, self._client = socket, planner, client
        self._left, self._last = BURST, time.monotonic()

    async def run(self) -> None:
        from starlette.websockets import WebSocketDisconnect

        answers = self._planner.join(self._client)
        try:
            shown = self._planner.shown
            await self._send(
                {"kind": "hello", "scene": shown.scene, "runs": shown.runs, "words": shown.words}
            )
            if self._planner.compiling:
                await self._socket.send_text(self._planner.compiling)
            sending = asyncio.create_task(self._forward(answers))
            try:
                while True:
                    await self._hear(await self._socket.receive_text())
            except (WebSocketDisconnect, KeyError):
                pass
            finally:
                sending.cancel()
        finally:
            self._planner.leave(self._client)

    async def _forward(self, answers: "asyncio.Queue[str]") -> None:
        while True:
            await self._socket.send_text(await answers.get())

    async def _send(self, message: Message) -> None:
        await self._socket.send_text(json.dumps(message, separators=(",", ":"), ensure_ascii=False))

    async def _hear(self, text: str) -> None:
        from starlette.websockets import WebSocketDisconnect

        now = time.monotonic()
        self._left = min(BURST, self._left + RATE * (now - self._last)) - 1
        self._last = now
        if self._left < 0:
            await self._socket.close(1008, "too many messages")
            raise WebSocketDisconnect(1008)
        try:
            number, kind, value = checked_message(text)
        except FlatpushError as error:
            await self._send({"kind": "error", "reason": str(error)})
            return
        self._planner.ask(self._client, number, kind, value)


def checked_message(text: str) -> tuple[int, str, dict[str, object]]:
    """Number, kind and value of a message of the page.

    Raises:
        InputError: for what is no such message.
    """

    def refuse(word: str) -> float:
        raise InputError("a finite number is needed", value=word)

    try:
        message = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError("a message is JSON", value=text[:40]) from None
    if not isinstance(message, dict) or set(message) != {"number", "kind", "value"}:
        raise InputError("a message has number, kind and value")
    number, kind, value = message["number"], message["kind"], message["value"]
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number < 2**53:
        raise InputError("the number of a message is a whole number from 1", key="number", value=number)
    if kind not in KINDS:
        raise InputError(f"the kind of a message is one of {', '.join(KINDS)}", key="kind", value=kind)
    if not isinstance(value, dict):
        raise InputError("the value of a message is a mapping", key="value", value=value)
    if not _shallow(value):
        raise InputError("the value of a message has at most 20 levels", key="value")
    return number, kind, value


def _shallow(value: object, left: int = 20) -> bool:
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return left > 0 and all(_shallow(item, left - 1) for item in items if isinstance(item, dict | list))


def _static(name: str) -> "Response":
    from starlette.responses import Response

    kind = TYPES.get(name[name.rfind(".") :]) if "." in name else None
    found = files(__package__).joinpath("static", name)
    if kind is None or "/" in name or not found.is_file():
        return Response(status_code=404)
    return Response(found.read_bytes(), media_type=f"{kind}; charset=utf-8", headers=HEADERS)


def _listen(options: Options, told: Callable[[str], None]) -> socket.socket:
    """A socket at the port asked for or the next one that is free."""
    family = socket.AF_INET6 if ":" in options.host else socket.AF_INET
    complaint = ""
    for port in [*range(options.port, min(options.port + TRIES, 65536)), 0]:
        listening = socket.socket(family, socket.SOCK_STREAM)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((options.host, port))
            listening.listen()  # who opens the link before the server runs waits for it
        except OSError as error:
            listening.close()
            complaint = complaint or error.strerror or str(error)
            if error.errno not in _IN_USE:
                break
            continue
        if options.port not in (0, port):
            told(f"port {options.port} is in use; this is port {listening.getsockname()[1]}")
        return listening
    raise InputError(
        f"nothing can be served at {options.host}: {complaint.lower()}", hint="Give another --host or --port."
    )


def _open(link: str, told: Callable[[str], None]) -> None:
    """Opens a browser, once the server has had a moment to start; where there is none the link is printed already."""
    import webbrowser

    time.sleep(0.1)
    try:
        opened = webbrowser.open(link)
    except webbrowser.Error:
        opened = False
    if not opened:
        told("no browser was found: open the link yourself")


def _is_local(host: str) -> bool:
    return host in ("127.0.0.1", "localhost", "::1")


def _host(name: str | None) -> str:
    return f"[{name}]" if name and ":" in name else name or ""
