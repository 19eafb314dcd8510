"""What several journeys use."""

import json
import shutil

import pytest
from tests.extras import extra
from tests.live_browser import Page
from tests.live_server import EXAMPLES, Served


@pytest.fixture(scope="module")
def server():
    """flatpush view of an example."""
    with Served(str(EXAMPLES / "triangle.yaml"), "--port", "0") as found:
        yield found


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """Chromium without a window; what it saves goes to the folder `downloads`."""
    webdriver = pytest.importorskip("selenium.webdriver", reason=extra("test"))
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if program is None or driver is None:
        pytest.skip("no browser: needs chromium and chromedriver (Debian: chromium, chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = program
    for flag in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    chromium = webdriver.Chrome(options, webdriver.ChromeService(driver))
    chromium.downloads = tmp_path_factory.mktemp("downloads")
    chromium.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(chromium.downloads)}
    )
    yield chromium
    chromium.quit()


@pytest.fixture
def page(browser, server):
    """The page with its first plan; all that it asks for must be here, and its console silent."""
    found = Page(browser, server)
    yield found
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [m["params"]["request"]["url"] for m in messages if m["method"] == "Network.requestWillBeSent"]
    asked += [m["params"]["url"] for m in messages if m["method"] == "Network.webSocketCreated"]
    local = ("data:", "blob:", "about:", f"http://{server.host}/", f"ws://{server.host}/")
    assert [url for url in asked if not url.startswith(local)] == []
    assert browser.get_log("browser") == []
