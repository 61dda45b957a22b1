"""The notebooks with widgets in a real JupyterLab, and as saved pages, in a real browser.

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

import numpy as np
import pytest

playwright = pytest.importorskip(
    "playwright.sync_api", reason="the browser tests need: make browser"
)

ROOT = Path(__file__).resolve().parent.parent
START, LAB = "00_start_here.ipynb", "07_interactive_lab.ipynb"
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
        pytest.skip("no Chromium: run make browser")
    return own


def jupyter() -> str:
    beside = Path(sys.executable).with_name("jupyter")
    for name in (os.environ.get("MOCAPLAB_JUPYTER"), str(beside), "jupyter"):
        if name and (found := shutil.which(name)):
            return found
    pytest.skip("no JupyterLab: pip install 'mocaplab[lab]', or set MOCAPLAB_JUPYTER")


def folder_of_notebooks() -> Path:
    folder = Path(os.environ.get("MOCAPLAB_NOTEBOOKS", ROOT / "notebooks"))
    for name in (START, LAB):
        if not (folder / name).exists():
            pytest.skip(f"there is no {name} in {folder.name}/")
    return folder


@pytest.fixture
def server(tmp_path: Path) -> Iterator[str]:
    """Start JupyterLab on a copy of the notebooks; yields its address."""
    notebooks = shutil.copytree(folder_of_notebooks(), tmp_path / "notebooks")
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


def run_all(page: Any, address: str, notebook: str) -> None:
    page.goto(f"{address}/lab/tree/{notebook}?reset")
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


def saved_cells(page: Any, address: str, notebook: str) -> list[dict[str, Any]]:
    """Save the notebook and read it back: the page itself may leave out far-off cells."""
    choose(page, "File", "Save Notebook")
    page.wait_for_selector(".jp-mod-dirty", state="detached")
    with urllib.request.urlopen(f"{address}/api/contents/{notebook}", timeout=30) as answer:
        cells: list[dict[str, Any]] = json.load(answer)["content"]["cells"]
    return cells


def assert_all_ran(page: Any, address: str, notebook: str) -> None:
    cells = saved_cells(page, address, notebook)
    cells = [c for c in cells if c["cell_type"] == "code" and c["source"]]
    assert not [o for cell in cells for o in cell["outputs"] if o["output_type"] == "error"]
    assert all(cell["execution_count"] for cell in cells)
    assert "Error displaying widget" not in page.locator(".jp-Notebook").inner_text()


def picture(canvas: Any) -> str:
    drawn: str = canvas.evaluate("canvas => canvas.toDataURL()")
    return drawn


def wait_for_change(page: Any, canvas: Any, before: str, limit_ms: int = 60_000) -> None:
    page.wait_for_function(
        "([canvas, before]) => canvas.toDataURL() !== before",
        arg=[canvas.element_handle(), before],
        timeout=limit_ms,
    )


def assert_plays(page: Any, player: Any) -> None:
    canvas = player.locator("canvas").first
    before = picture(canvas)
    player.get_by_role("button", name="Play").click()
    page.wait_for_timeout(1000)
    player.get_by_role("button", name="Pause").click()
    page.wait_for_timeout(300)
    assert picture(canvas) != before, "the picture did not move after Play"


def latencies_ms(page: Any, slider: Any, canvas: Any, moves: int = 30) -> list[float]:
    """Measure the time from a move of a slider to the new picture on a canvas."""
    times: list[float] = page.evaluate(
        """async ([slider, canvas, moves]) => {
          const pen = canvas.getContext("2d");
          const look = () => { // much faster than a PNG
            const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
            let sum = 0;
            for (let i = 0; i < data.length; i++) sum = (31 * sum + data[i]) | 0;
            return sum;
          };
          const times = [];
          const [low, high] = [Number(slider.min), Number(slider.max)];
          for (let i = 0; i < moves; i++) {
            const before = look();
            const share = ((i * 7) % moves) / moves; // all over the slider
            let value = low + Math.round(share * (high - low));
            if (value === Number(slider.value)) value += value < high ? 1 : -1;
            const start = performance.now();
            slider.value = value;
            slider.dispatchEvent(new Event("input", { bubbles: true }));
            do await new Promise(requestAnimationFrame);
            while (look() === before && performance.now() - start < 5000);
            times.push(performance.now() - start);
          }
          return times;
        }""",
        [slider.element_handle(), canvas.element_handle(), moves],
    )
    return times


def tell(name: str, times: list[float]) -> None:
    """Print a measurement and keep it beside the screenshots."""
    line = f"{name}: median {np.median(times):.0f} ms, worst {max(times):.0f} ms of {len(times)}"
    print(line)
    if folder := os.environ.get("MOCAPLAB_SCREENSHOTS"):
        Path(folder).mkdir(parents=True, exist_ok=True)
        with (Path(folder) / "latency.txt").open("a") as file:
            file.write(line + "\n")


def assert_a_joint_can_be_picked(page: Any, player: Any) -> None:
    """Click over the body until a joint is hit; its curve comes up, and its trail."""
    canvas = player.locator("canvas").first
    strip = player.locator("canvas").nth(1)
    assert not strip.is_visible()
    box = canvas.bounding_box()
    for share in np.linspace(0.2, 0.8, 40):
        canvas.click(position={"x": 0.5 * box["width"], "y": share * box["height"]})
        page.wait_for_timeout(50)
        if strip.is_visible():
            break
    assert strip.is_visible(), "no click found a joint"
    before = picture(canvas)
    player.get_by_label("trails").check()
    page.wait_for_timeout(200)
    assert picture(canvas) != before, "trails should show"
    keep(page, "start_picked")


def test_start_here_runs_and_the_player_plays(page: Any, server: str) -> None:
    failures: list[str] = []
    page.on("pageerror", lambda error: failures.append(str(error)))
    run_all(page, server, START)
    assert_all_ran(page, server, START)

    player = page.locator(".mocaplab-player").first
    player.scroll_into_view_if_needed()
    canvas = player.locator("canvas").first
    canvas.wait_for()
    keep(page, "start_light")
    before = picture(canvas)
    assert_plays(page, player)

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

    assert_a_joint_can_be_picked(page, player)
    light = picture(canvas)
    choose(page, "Settings", "Theme", "JupyterLab Dark")
    page.wait_for_timeout(2000)
    assert picture(canvas) != light, "the colours should follow Lab's theme"
    keep(page, "start_dark")
    assert not failures


def test_the_lab_answers(page: Any, server: str) -> None:
    failures: list[str] = []
    page.on("pageerror", lambda error: failures.append(str(error)))
    run_all(page, server, LAB)
    assert_all_ran(page, server, LAB)
    lab = page.locator(".mocaplab-lab").first
    lab.scroll_into_view_if_needed()
    curves = lab.get_by_role("img", name="Curves of the channel over time")
    errors = lab.get_by_role("img", name="Error of the Gaussian over its width")
    curves.wait_for()
    keep(page, "lab_light")

    for name in ("Gaussian sigma", "Look-ahead"):
        slider = lab.get_by_role("slider", name=name)
        tell(name, latencies_ms(page, slider, errors))
        for value in ("min", "max"):
            slider.evaluate(
                "(s, end) => { s.value = s[end]; s.dispatchEvent(new Event('input')); }", value
            )
            page.wait_for_timeout(100)
    tell("Frame", latencies_ms(page, lab.get_by_role("slider", name="Frame"), curves))

    for name in ("Joint", "Channel"):
        before = picture(curves)
        menu = lab.get_by_role("combobox", name=name)
        menu.select_option(index=1 if name == "Channel" else 4)
        wait_for_change(page, curves, before)
    heat = lab.get_by_role("img", name="Widths that EBF chose")
    heading = lab.locator("h4").first
    before_text = heading.inner_text()
    heat.click(position={"x": 200, "y": 60})
    page.wait_for_timeout(200)
    assert heading.inner_text() != before_text, "a click on the map should go there"

    assert_wishes_are_met(page, lab, curves)
    assert_plays(page, lab.locator(".mocaplab-player"))

    page.set_viewport_size({"width": 1024, "height": 1000})
    choose(page, "Settings", "Theme", "JupyterLab Dark")
    page.wait_for_timeout(1500)
    lab.scroll_into_view_if_needed()
    keep(page, "lab_dark")
    assert not failures


def assert_wishes_are_met(page: Any, lab: Any, curves: Any) -> None:
    """Other noise and gaps come from Python, with a mark until they are there."""
    times = []
    for name, value in (("Noise amount", "0.9"), ("Gap length", "0.6"), ("Noise amount", "0.2")):
        before = picture(curves)
        start = time.monotonic()
        lab.get_by_role("slider", name=name).evaluate(
            "(s, value) => { s.value = value; s.dispatchEvent(new Event('input')); }", value
        )
        page.wait_for_selector(".mocaplab-lab.busy")
        wait_for_change(page, curves, before)
        page.wait_for_selector(".mocaplab-lab.busy", state="detached")
        times.append(1000 * (time.monotonic() - start))
    before = picture(curves)
    lab.get_by_role("combobox", name="Noise", exact=True).select_option("spikes")
    wait_for_change(page, curves, before)
    tell("Noise amount and gap, through Python", times)
    keep(page, "lab_spikes_and_gaps")


@pytest.mark.parametrize("notebook", [START, LAB])
def test_saved_pages_play_without_a_kernel(page: Any, tmp_path: Path, notebook: str) -> None:
    source = folder_of_notebooks() / notebook
    command = [jupyter(), "nbconvert", "--to", "html", str(source), "--output-dir", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=RUN_S)
    failures: list[str] = []
    page.on("pageerror", lambda error: failures.append(str(error)))
    page.context.set_offline(True)
    page.goto((tmp_path / notebook).with_suffix(".html").as_uri(), wait_until="domcontentloaded")
    player = page.locator(".mocaplab-player").first
    player.wait_for()
    player.scroll_into_view_if_needed()
    assert_plays(page, player)
    if notebook == LAB:
        lab = page.locator(".mocaplab-lab").first
        curves = lab.get_by_role("img", name="Curves of the channel over time")
        errors = lab.get_by_role("img", name="Error of the Gaussian over its width")
        for name in ("Gaussian sigma", "Look-ahead"):
            tell(f"{name}, saved page", latencies_ms(page, lab.get_by_label(name), errors))
        before = picture(curves)
        lab.get_by_role("combobox", name="Joint").select_option(index=4)
        wait_for_change(page, curves, before)
        assert lab.get_by_role("slider", name="Noise amount").is_disabled()
        lab.scroll_into_view_if_needed()
    keep(page, f"saved_{notebook[:2]}")
    own = [text for text in failures if "require" not in text and "MathJax" not in text]
    assert not own
