"""The first notebook in a real JupyterLab, seen through a real browser.

Skipped where the Python package playwright or a Chromium browser is missing. Both can
be put anywhere: JupyterLab is started as a program of its own (MOCAPLAB_JUPYTER names
it; by default the one beside this Python or on the PATH). MOCAPLAB_CHROMIUM names a
browser in an unusual place, MOCAPLAB_SCREENSHOTS a folder to keep pictures in, and
MOCAPLAB_NOTEBOOKS another folder of notebooks.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

playwright = pytest.importorskip(
    "playwright.sync_api", reason="the browser test needs: pip install playwright"
)

ROOT = Path(__file__).resolve().parent.parent
NOTEBOOK = "00_start_here.ipynb"
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
START_S, RUN_S = 120, 240


def chromium() -> str:
    """Find a browser of the system, or the one that playwright installed."""
    for name in filter(None, (os.environ.get("MOCAPLAB_CHROMIUM"), *NAMES)):
        if found := shutil.which(name):
            return found
    with playwright.sync_playwright() as p:
        own = p.chromium.executable_path
    if not Path(own).exists():
        pytest.skip("no Chromium: install it, or run `playwright install chromium`")
    return own


def jupyter() -> str:
    beside = Path(sys.executable).with_name("jupyter")
    for name in (os.environ.get("MOCAPLAB_JUPYTER"), str(beside), "jupyter"):
        if name and (found := shutil.which(name)):
            return found
    pytest.skip("no JupyterLab: pip install 'mocaplab[lab]', or set MOCAPLAB_JUPYTER")


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[str]:
    """Start JupyterLab on a copy of the notebooks; yields its address."""
    folder = Path(os.environ.get("MOCAPLAB_NOTEBOOKS", ROOT / "notebooks"))
    if not (folder / NOTEBOOK).exists():
        pytest.skip(f"there is no {NOTEBOOK} in {folder.name}/")
    notebooks = shutil.copytree(folder, tmp_path / "notebooks")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    environment = {
        **os.environ,
        # The kernel imports this working tree, and nothing is read from the user's settings.
        "PYTHONPATH": os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")])),
        "JUPYTER_CONFIG_DIR": str(tmp_path / "config"),
        "JUPYTER_DATA_DIR": str(tmp_path / "data"),
        "JUPYTER_RUNTIME_DIR": str(tmp_path / "runtime"),
    }
    log = tmp_path / "lab.log"
    command = [jupyter(), "lab", "--no-browser", "--allow-root", f"--port={port}"]
    command += ["--ServerApp.ip=127.0.0.1", "--ServerApp.port_retries=0"]
    command += ["--IdentityProvider.token=", f"--ServerApp.root_dir={notebooks}"]
    command += ["--LabApp.check_for_updates_class=jupyterlab.NeverCheckForUpdate"]
    with log.open("w") as output:
        server = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
        try:
            address = f"http://127.0.0.1:{port}"
            wait_for_server(address, server, log)
            yield address
        finally:
            server.terminate()
            server.wait(30)


def wait_for_server(address: str, server: subprocess.Popen[bytes], log: Path) -> None:
    end = time.monotonic() + START_S
    while time.monotonic() < end:
        if server.poll() is not None:
            break
        try:
            urllib.request.urlopen(f"{address}/api/status", timeout=5).close()
            return
        except OSError:
            time.sleep(0.3)
    pytest.fail(f"JupyterLab did not start:\n{log.read_text()[-2000:]}")


@pytest.fixture
def page() -> Iterator[Any]:
    path = chromium()
    with playwright.sync_playwright() as p:
        # Containers have no sandbox of their own to offer; the pages are our own.
        browser = p.chromium.launch(executable_path=path, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1200, "height": 1000})
        page.set_default_timeout(60_000)
        yield page
        browser.close()


def keep(page: Any, name: str) -> None:
    if folder := os.environ.get("MOCAPLAB_SCREENSHOTS"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=str(Path(folder) / f"{name}.png"))


def choose(page: Any, menu: str, *entries: str) -> None:
    """Click through Lab's menus."""
    page.get_by_role("menuitem", name=menu, exact=True).click()
    for entry in entries[:-1]:
        page.get_by_text(entry, exact=True).hover()
    page.get_by_text(entries[-1], exact=True).click()


def run_all(page: Any, address: str) -> None:
    page.goto(f"{address}/lab/tree/{NOTEBOOK}?reset")
    page.wait_for_selector(".jp-Notebook .jp-CodeCell")
    # Before its kernel is ready, Lab answers Run with a question about kernels.
    page.get_by_text(re.compile(r"\| Idle$")).wait_for()
    no_news = page.get_by_role("button", name="No", exact=True)
    if no_news.is_visible():
        no_news.click()
    choose(page, "Run", "Run All Cells")
    # "[*]:" waits or runs, "[3]:" has run. The kernel's own "idle" also comes in between.
    page.wait_for_function(
        """() => {
          const prompts = [...document.querySelectorAll(".jp-CodeCell .jp-InputPrompt")];
          const texts = prompts.map((prompt) => prompt.textContent);
          return texts.some((t) => /\\d/.test(t)) && !texts.some((t) => t.includes("*"));
        }""",
        timeout=1000 * RUN_S,
    )


def saved_cells(page: Any, address: str) -> list[dict[str, Any]]:
    """Save the notebook and read it back: the page itself may leave out far-off cells."""
    choose(page, "File", "Save Notebook")
    page.wait_for_selector(".jp-mod-dirty", state="detached")
    with urllib.request.urlopen(f"{address}/api/contents/{NOTEBOOK}", timeout=30) as answer:
        cells: list[dict[str, Any]] = json.load(answer)["content"]["cells"]
    return cells


def picture(canvas: Any) -> str:
    drawn: str = canvas.evaluate("canvas => canvas.toDataURL()")
    return drawn


def test_start_here_runs_and_the_player_plays(page: Any, lab: str) -> None:
    failures: list[str] = []
    page.on("pageerror", lambda error: failures.append(str(error)))
    run_all(page, lab)

    cells = [c for c in saved_cells(page, lab) if c["cell_type"] == "code" and c["source"]]
    errors = [o for cell in cells for o in cell["outputs"] if o["output_type"] == "error"]
    assert not errors
    assert all(cell["execution_count"] for cell in cells)
    assert "Error displaying widget" not in page.locator(".jp-Notebook").inner_text()

    player = page.locator(".mocaplab-player").first
    player.scroll_into_view_if_needed()
    canvas = player.locator("canvas")
    canvas.wait_for()
    keep(page, "lab_light")

    before = picture(canvas)
    player.get_by_role("button", name="Play").click()
    page.wait_for_timeout(1000)
    player.get_by_role("button", name="Pause").click()
    page.wait_for_timeout(300)
    assert picture(canvas) != before, "the picture did not move after Play"

    slider = player.get_by_role("slider", name="Frame")
    slider.focus()
    slider.press("Home")
    page.wait_for_timeout(200)
    assert picture(canvas) == before, "frame 0 should look as it did at first"

    # Lab's own shortcuts (down: next cell, d d: delete) must not act from the player.
    selected = ".jp-Notebook .jp-Cell.jp-mod-active"
    number = page.locator(".jp-Notebook .jp-Cell").count()
    active = page.locator(selected).first.get_attribute("data-windowed-list-index")
    for key in ("End", "ArrowDown", "ArrowDown", "d", "d"):
        slider.press(key)
    page.wait_for_timeout(300)
    assert page.locator(".jp-Notebook .jp-Cell").count() == number
    assert page.locator(selected).first.get_attribute("data-windowed-list-index") == active
    assert picture(canvas) != before

    light = picture(canvas)
    canvas.focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(200)
    assert picture(canvas) != light, "the arrow keys should turn the view"
    player.get_by_role("button", name="Reset view").click()
    page.wait_for_timeout(200)
    assert picture(canvas) == light

    choose(page, "Settings", "Theme", "JupyterLab Dark")
    page.wait_for_timeout(2000)
    assert picture(canvas) != light, "the colours should follow Lab's theme"
    keep(page, "lab_dark")
    assert not failures
