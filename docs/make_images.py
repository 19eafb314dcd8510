"""Draws the pictures of README and docs anew: python docs/make_images.py [NAME…], some minutes for all of them.

Those of recorded data and of timings come from `flatpush experiment` and `benchmarks/`, as their pages say.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IMAGES = ROOT / "docs" / "images"
EXAMPLES = ROOT / "examples"

# The picture, and the commands that draw it; {out} is the file, {tmp} a folder for what lies between.
PICTURES: dict[str, list[str]] = {
    "triangle.svg": ["plan {examples}/triangle.yaml --figure {out}"],
    "maze.svg": ["plan {examples}/maze.yaml --figure {out} --snapshots {images}/maze_snapshots.svg"],
    "anywhere.svg": ["plan {examples}/anywhere.yaml --figure {out}"],
    "stable_region.svg": ["describe {examples}/triangle.yaml --figure {out}"],
    "tube.svg": [
        "plan {examples}/rectangle_three_feet.yaml -o {tmp}/plan.json",
        "simulate {tmp}/plan.json --runs 200 --seed 7 --figure {out}",
    ],
    "track.svg": [
        "plan {examples}/disc.yaml -o {tmp}/plan.json",
        "track {tmp}/plan.json --controller path --start 1,1,1 --figure {out}",
    ],
    "horizon.svg": [
        "plan {examples}/triangle_one_finger.yaml -o {tmp}/plan.json",
        "track {tmp}/plan.json --controller horizon --learn --friction 0.25 --centre 0.5,0.5 --seed 1 --figure {out}",
    ],
}

# Of the live page: its scene, what is done on it before the picture, the size of the window, and whether it is dark.
BLOCK = "for (let k = 0; k < 2; k++) document.getElementById('add').click(); flatpush.model.select('');"
SHOVED = """
document.getElementById('controller').value = 'horizon'; document.getElementById('speed').value = '8';
document.getElementById('follow').click();
const wait = setInterval(() => {
  const { live } = flatpush.feedback;
  if (live.height.length < 90 || live.height.slice(-90).some((height) => height > 0)) return;
  const [x, y, angle] = flatpush.feedback.pose;
  flatpush.feedback.shove([x + 10, y - 40, angle]);
  clearInterval(wait);
}, 50);
"""
READY = (
    "return window.flatpush && flatpush.answered && !flatpush.busy"
    " && !flatpush.feedback.on && (!flatpush.mechanics.name || Boolean(flatpush.mechanics.shown));"
)
PAGES: dict[str, tuple[str, str, tuple[int, int], bool]] = {
    "page.png": ("triangle", "", (1280, 720), False),
    "page_dark.png": ("triangle", BLOCK, (1000, 700), True),
    "page_mechanics.png": (
        "triangle",
        "document.querySelector('[data-push=\"0\"]').click();",
        (1280, 720),
        False,
    ),
    "page_feedback.png": ("triangle_one_finger", SHOVED, (1280, 720), False),
}


def photograph(name: str) -> None:
    """A picture of flatpush view in headless Chromium."""
    import shutil
    import signal
    import time

    from selenium import webdriver

    scene, script, (width, height), dark = PAGES[name]
    served = subprocess.Popen(
        [sys.executable, "-c", "from flatpush.cli import main; main()", "view", "--no-browser", "--port", "0",
         str(EXAMPLES / f"{scene}.yaml")],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert served.stderr is not None
    link = served.stderr.readline().split()[-1]
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
        options.add_argument(flag)
    browser = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
        browser.get(link)
        shown = "flatpush.player.show(0.3 * flatpush.player.duration);"
        if scene != "triangle":
            shown = "flatpush.table.fit(); flatpush.player.show(0.75 * flatpush.player.duration);"
        for step in ("", script, shown):
            browser.execute_script(step)
            while not browser.execute_script(READY):
                time.sleep(0.1)
        browser.save_screenshot(str(IMAGES / name))
    finally:
        browser.quit()
        served.send_signal(signal.SIGINT)
        served.wait(10)


def draw(name: str) -> None:
    """Runs the commands of one picture; a command that fails ends the program."""
    with tempfile.TemporaryDirectory() as folder:
        for command in PICTURES[name]:
            words = command.format(out=IMAGES / name, tmp=folder, images=IMAGES, examples=EXAMPLES).split()
            subprocess.run(
                [sys.executable, "-c", "from flatpush.cli import main; main()", *words], check=True
            )


if __name__ == "__main__":
    known = [*PICTURES, *PAGES]
    wanted = sys.argv[1:] or known
    unknown = [name for name in wanted if name not in known]
    if unknown:
        sys.exit(f"no such picture: {', '.join(unknown)}; there are {', '.join(known)}")
    for name in wanted:
        print(name, flush=True)
        if name in PAGES:
            photograph(name)
        else:
            draw(name)
