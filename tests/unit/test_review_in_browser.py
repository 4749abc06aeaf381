"""The report in a real browser: no script error, nothing empty, and it turns and reads out."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import synthetic_flight
from synthetic_flight import log_of

from lcd_flight.review.page import page

BROWSER = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(BROWSER is None, reason="no chromium: apt-get install chromium"),
]

PROBE = """
<script>
const found = { errors: [] };
window.addEventListener("error", (event) => found.errors.push(event.message));
const line = document.querySelector(".space polyline.flown");
const drawing = document.querySelector(".space");
const places = () => line.getAttribute("points");
window.requestAnimationFrame = (draw) => setTimeout(draw, 10);  // nothing is painted without a screen
const frames = () => new Promise((done) => setTimeout(done, 50));
const outputs = () => [...document.querySelectorAll(".chart output")].map((output) => output.textContent);
async function probe() {
  found.live = document.body.classList.contains("live");
  found.python = places();
  found.boxes = [...document.querySelectorAll(".trace")].map((trace) => {
    const box = trace.getBoundingClientRect();
    return [box.width, box.height];
  });
  found.overflow = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  drawing.dispatchEvent(new MouseEvent("dblclick"));
  await frames();
  found.script = places();
  drawing.setPointerCapture = () => {};
  drawing.hasPointerCapture = () => true;
  drawing.dispatchEvent(new PointerEvent("pointermove", { movementX: 60, movementY: 15 }));
  await frames();
  found.turned = places();
  drawing.dispatchEvent(new WheelEvent("wheel", { deltaY: -100, ctrlKey: true, cancelable: true }));
  await frames();
  found.zoomed = places();
  const now = drawing.querySelector(".now");
  found.before = now.getAttribute("transform");
  const slider = document.querySelector(".player input");
  slider.value = 5.0;
  slider.dispatchEvent(new Event("input"));
  found.after = now.getAttribute("transform");
  found.outputs = outputs();
  found.clock = document.querySelector(".player output").textContent;
  const result = document.createElement("pre");
  result.id = "found";
  result.textContent = JSON.stringify(found);
  document.body.append(result);
}
probe();
</script>
"""


def browse(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Open a page without a screen and without a network."""
    assert BROWSER is not None
    command = [
        BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-background-networking",
        "--no-first-run",
        "--enable-logging=stderr",
        f"--user-data-dir={path.parent / 'profile'}",
        *arguments,
        path.as_uri(),
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a script saw that handled the page."""
    path = tmp_path_factory.mktemp("page") / "report.html"
    path.write_text(page(log_of(synthetic_flight.flight())).replace("</body>", PROBE + "</body>"), encoding="utf-8")
    done = browse(path, "--window-size=1200,900", "--virtual-time-budget=5000", "--dump-dom")
    assert "CONSOLE" not in done.stderr, done.stderr
    result = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert result is not None, done.stdout[-2000:]
    answer: dict[str, Any] = json.loads(html.unescape(result[1]))
    return answer


def numbers(points: str) -> list[float]:
    return [float(number) for number in re.split("[ ,]", points)]


def test_no_script_error(found: dict[str, Any]) -> None:
    assert found["errors"] == []
    assert found["live"] is True


def test_no_trace_is_empty(found: dict[str, Any]) -> None:
    assert len(found["boxes"]) >= 20
    assert all(width > 100 for width, _ in found["boxes"])
    assert sum(height > 5 for _, height in found["boxes"]) >= 12


def test_script_and_still_draw_the_same_path(found: dict[str, Any]) -> None:
    assert numbers(found["script"]) == pytest.approx(numbers(found["python"]), abs=0.25)


def test_the_path_turns_and_zooms(found: dict[str, Any]) -> None:
    assert found["turned"] != found["script"]
    assert found["zoomed"] != found["turned"]


def test_one_instant_moves_through_path_and_charts(found: dict[str, Any]) -> None:
    assert found["after"] != found["before"]
    assert found["clock"] == "5.00 s"
    values = found["outputs"]
    assert len(values) == len(found["boxes"])
    assert float(values[0]) == pytest.approx(0.1, rel=0.02)  # the error, read back from its logarithmic axis
    _, tick = synthetic_flight.flight()[500]
    assert tick.reference is not None
    read = [float(text.replace("\N{MINUS SIGN}", "-")) for text in values[1:7:2]]
    assert read == pytest.approx(tick.reference.p_W, abs=0.03)


def test_a_phone_needs_no_scrolling_sideways(tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text(page(log_of(synthetic_flight.flight())).replace("</body>", PROBE + "</body>"), encoding="utf-8")
    done = browse(path, "--window-size=500,900", "--virtual-time-budget=5000", "--dump-dom")
    result = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
    assert result is not None
    assert json.loads(html.unescape(result[1]))["overflow"] == 0
