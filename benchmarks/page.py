"""How quickly the live page answers, in headless Chromium: python benchmarks/page.py [MOVES], a minute.

From a pointer's move to the new path on the screen, while start and goal are dragged: among nothing and among ten
obstacles; from the start of `flatpush view` to the first plan on the screen, with compiled kernels; and how often the
object is moved in a second while the pointer pushes it. CPU is that of server and planner together while the pointer
moves, for each path or step, and that of the browser: it does not depend much on who else uses the machine. What the
browser itself takes is seen beside it, by a page on which the pointer moves a circle and nothing else.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from selenium import webdriver

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "triangle.yaml"
WAIT = 60  # for anything [s]
CIRCLE = """data:text/html,<body style="margin:0"><svg width="1280" height="720"><circle id="c" r="20"/></svg><script>
const c = document.getElementById("c"), times = window.times = [];
onpointermove = (event) => {
  c.setAttribute("cx", event.clientX); c.setAttribute("cy", event.clientY);
  requestAnimationFrame(() => setTimeout(() => times.push(performance.now() - event.timeStamp)));
};</script>"""


def served(scene: Path) -> tuple[subprocess.Popen[str], str, float]:
    """The server, its link, and when it was started [s]."""
    began = time.perf_counter()
    command = [
        sys.executable,
        "-c",
        "from flatpush.cli import main; main()",
        "view",
        "--no-browser",
        "--port",
        "0",
    ]
    server = subprocess.Popen([*command, str(scene)], stderr=subprocess.PIPE, text=True)
    assert server.stderr is not None
    return server, server.stderr.readline().split()[-1], began


def crowded(folder: Path) -> Path:
    """The triangle among ten obstacles that leave a way."""
    import yaml

    from flatpush.documents import load_scene
    from flatpush.page.in_mm import scene_in_mm

    scene = scene_in_mm(load_scene(EXAMPLE))
    places = [(-140 + 40 * k, 135) for k in range(5)] + [(-120 + 40 * k, -75) for k in range(5)]
    scene["workspace"] = {
        "obstacles": [[[x, y], [x + 20, y], [x + 20, y + 20], [x, y + 20]] for x, y in places]
    }
    path = folder / "crowded.yaml"
    path.write_text(yaml.safe_dump(scene), encoding="utf-8")
    return path


def wait(browser: webdriver.Chrome, condition: str) -> None:
    until = time.monotonic() + WAIT
    while not browser.execute_script(f"return Boolean({condition})"):
        if time.monotonic() > until:
            sys.exit(f"it never came: {condition}")
        time.sleep(0.002)


def spent(first: int) -> float:
    """CPU time of a process and of all that it started, so far [s]."""
    parents, ticks = dict[int, int](), dict[int, int]()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has just ended
            continue
        number = int(folder.name)
        parents[number], ticks[number] = int(fields[1]), int(fields[11]) + int(fields[12])
    total, family = 0, {first}
    while family:
        total += sum(ticks[number] for number in family)
        family = {number for number, parent in parents.items() if parent in family}
    return total / os.sysconf("SC_CLK_TCK")


def said(times: list[float], cpu: dict[str, float]) -> dict[str, float]:
    """Quantiles of times [ms], and CPU times [s] for each of them."""
    middle, most = np.quantile(times, [0.5, 0.95]) if times else (np.nan, np.nan)
    each = {f"CPU of {name} [ms]": round(1000 * value / max(len(times), 1), 1) for name, value in cpu.items()}
    return {"median [ms]": round(float(middle), 1), "95 % [ms]": round(float(most), 1), **each}


def stroke(browser: webdriver.Chrome, moves: int, place: Callable[[int], tuple[float, float]]) -> None:
    """Presses the pointer, moves it from place to place at 60 moves a second, and lets go."""

    def mouse(kind: str, k: int) -> None:
        x, y = place(k)
        event = {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
        browser.execute_cdp_cmd("Input.dispatchMouseEvent", event)

    mouse("mousePressed", 0)
    began = time.perf_counter()
    for k in range(1, moves + 1):
        time.sleep(max(0.0, began + k / 60 - time.perf_counter()))
        mouse("mouseMoved", k)
    mouse("mouseReleased", moves)


def pushed(browser: webdriver.Chrome, moves: int) -> tuple[list[float], float]:
    """Times from a step that is asked for to the object that has moved [ms], and how long the pointer pushes [s]."""
    browser.execute_script("document.getElementById('push').click(); flatpush.hand.frames.length = 0;")
    x, y, _, high = browser.execute_script(
        "const b = document.querySelector('#hand .body').getBoundingClientRect();"
        "return [b.x, b.y, b.width, b.height];"
    )

    def place(k: int) -> tuple[float, float]:
        return x - 20 + 60 * k / moves, y + high / 2

    began = time.perf_counter()
    stroke(browser, moves, place)
    spent = time.perf_counter() - began
    times = [float(v) for v in browser.execute_script("return flatpush.hand.frames")]
    browser.execute_script("document.getElementById('push').click();")
    return times, spent


def dragged(
    browser: webdriver.Chrome, cpu: Callable[[], dict[str, float]], thing: str, moves: int
) -> tuple[list[float], dict[str, float]]:
    """Latencies [ms] of a drag at 60 moves a second, and the CPU times that it took [s]."""
    before = cpu()
    x, y = browser.execute_script(
        "const b = document.querySelector(arguments[0]).getBoundingClientRect();"
        "return [b.x + b.width / 2, b.y + b.height / 2];",
        f"#{thing} .body",
    )

    def place(k: int) -> tuple[float, float]:
        angle = 2 * np.pi * k / max(moves, 1)
        return x + 40 * np.sin(angle), y + 20 * np.sin(2 * angle)

    browser.execute_script("flatpush.latencies.length = 0")
    stroke(browser, moves, place)
    after = cpu()
    wait(browser, "!flatpush.busy")
    times = [float(v) for v in browser.execute_script("return flatpush.latencies")]
    return times, {name: after[name] - before[name] for name in after}


def main() -> None:
    moves = int(sys.argv[1]) if len(sys.argv) > 1 else 240
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in (
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--disable-gpu",
        "--window-size=1280,720",
    ):
        options.add_argument(flag)
    browser = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    found: dict[str, object] = {"moves": moves}
    driver = browser.service.process.pid  # type: ignore[union-attr]
    size = {"width": 1280, "height": 720, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        browser.get(CIRCLE)
        used = spent(driver)
        stroke(browser, moves, lambda k: (300 + k, 300))
        times = [float(v) for v in browser.execute_script("return times")]
        found["a circle moved, and nothing else"] = said(times, {"the browser": spent(driver) - used})
        with tempfile.TemporaryDirectory() as folder:
            for name, scene in (("free", EXAMPLE), ("ten obstacles", crowded(Path(folder)))):
                server, link, began = served(scene)

                def cpu(first: int = server.pid) -> dict[str, float]:
                    return {"server and planner": spent(first), "the browser": spent(driver)}

                browser.get(link)
                wait(browser, "window.flatpush && flatpush.answered")
                found[f"{name}: first plan after the start of the server [s]"] = round(
                    time.perf_counter() - began, 2
                )
                wait(browser, "!flatpush.busy")
                for thing in ("start", "goal"):
                    times, used_up = dragged(browser, cpu, thing, moves)
                    found[f"{name}: {thing} dragged"] = {"paths": len(times), **said(times, used_up)}
                if name == "free":
                    before = cpu()
                    times, long = pushed(browser, moves)
                    rate = round(len(times) / long, 1)
                    used_up = {key: value - before[key] for key, value in cpu().items()}
                    found["pushed by the pointer"] = {"steps a second": rate, **said(times, used_up)}
                server.send_signal(signal.SIGINT)
                server.wait(WAIT)
    finally:
        browser.quit()
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
