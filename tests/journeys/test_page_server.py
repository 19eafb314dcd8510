"""The server of the live page from outside: who gets what, and what it does with what is no message."""

import json
import socket
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from tests.extras import extra
from tests.live_server import COMMAND, PATIENCE, Served
from tests.waiting import until

pytestmark = pytest.mark.slow
pytest.importorskip("uvicorn", reason=extra("page"))
pytest.importorskip("starlette", reason=extra("page"))


@pytest.fixture
def talk(server):
    """Opens a WebSocket to the server as a page would, with other headers or another token if asked."""
    from websockets.sync.client import connect

    with ExitStack() as opened:

        def start(token=None, host=server.host, **more):
            more.setdefault("origin", f"http://{host}")
            address = f"ws://{host}/live?token={server.token if token is None else token}"
            home, port = server.host.split(":")
            there = opened.enter_context(socket.create_connection((home, int(port))))
            line = connect(
                address, sock=there, open_timeout=PATIENCE, max_size=None, compression=None, **more
            )
            return opened.enter_context(line)

        yield start


def ask(line, number, kind, value):
    line.send(json.dumps({"number": number, "kind": kind, "value": value}))


def hear(line, kind):
    """The next message of a kind."""

    def heard():
        message = json.loads(line.recv(PATIENCE))
        return message if message["kind"] == kind else None

    return until(heard, pause=0)


def test_only_who_has_the_link_gets_the_page(server):
    status, headers, body = server.get(f"/?token={server.token}")
    assert status == 200
    assert b"<title>flatpush</title>" in body
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    for path in ("/", "/?token=wrong"):
        assert server.get(path)[0] == 403
    for path in ("/server.py", "/..%2fserver.py", "/%2e%2e/server.py", "/nothing.js"):
        assert server.get(path)[0] == 404
    assert server.get(f"/?token={server.token}", Host="evil.example")[0] == 403


@pytest.mark.parametrize(
    "wrong",
    [
        {"token": "wrong"},
        {"token": ""},
        {"origin": "http://evil.example"},
        {"origin": None},
        {"host": "evil.example"},  # a name of theirs that leads to this machine
    ],
)
def test_a_foreign_page_gets_no_connection(talk, wrong):
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus, match="403"):
        talk(**wrong)


def test_a_message_is_answered_or_refused_and_the_next_one_still_counts(server, talk):
    line = talk()
    scene = hear(line, "hello")["scene"]
    line.send("{")
    assert "a message is JSON" in hear(line, "error")["reason"]
    ask(line, 1, "plan", {"flatpush": "scene/1"})
    answer = hear(line, "plan")
    assert (answer["status"], answer["number"]) == ("refused", 1)
    assert "object" in answer["reason"]
    scene["object"]["outline"] = {"file": "/etc/hostname"}
    ask(line, 2, "plan", scene)
    assert "names no files" in hear(line, "plan")["reason"]
    other = talk()  # a second tab
    whole = hear(other, "hello")["scene"]
    ask(other, 1, "plan", whole)
    assert hear(other, "plan")["status"] == "solved"
    assert hear(other, "done")["number"] == 1


def flood(line, messages):
    """Sends all, a thousand a second, and listens until the other side has had enough.

    All at once, the reset that answers what is still under way could overtake the word that tells why.
    """
    for message in messages:
        line.send(message)
        time.sleep(0.001)
    until(lambda: line.recv(PATIENCE) and False, pause=0)


def test_too_much_and_too_often_ends_the_connection_alone(server, talk):
    from websockets.exceptions import ConnectionClosed

    line = talk()
    hear(line, "hello")
    with pytest.raises(ConnectionClosed) as ended:
        flood(line, ["x" * 4_000_000])
    last = ended.value.rcvd
    assert last is None or last.code == 1009
    line = talk()
    with pytest.raises(ConnectionClosed) as ended:
        flood(line, ["{}"] * 2000)
    last = ended.value.rcvd  # None where what was still being sent met a closed socket
    assert last is None or last.code == 1008
    assert hear(talk(), "hello")["scene"]["object"]["name"] == "triangle"


def test_a_port_that_is_taken_is_not_in_the_way_and_ctrl_c_ends_everything():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with Served("--port", str(port)) as served:
            assert f"port {port} is in use; this is port" in served.said
            children = subprocess.run(
                ["ps", "-o", "pid=", "--ppid", str(served.process.pid)],
                capture_output=True,
                text=True,
                timeout=PATIENCE,
            ).stdout.split()
            assert served.stop() == 130
            assert "Traceback" not in served.process.stderr.read()
            until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in children), 5)


def test_an_address_of_another_machine_is_refused_in_words():
    ended = subprocess.run(
        [*COMMAND, "--host", "203.0.113.9"], capture_output=True, text=True, timeout=PATIENCE
    )
    assert ended.returncode == 2
    assert "nothing can be served at 203.0.113.9" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_the_page_weighs_little():
    static = Path(__file__).parents[2] / "src" / "flatpush" / "page" / "static"
    assert sum(file.stat().st_size for file in static.iterdir()) < 250_000
