"""The report page: what it embeds, and what keys and mouse do in headless Chromium."""

from __future__ import annotations

import base64
import dataclasses
import json
import re
import shutil
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import exr_images
import mitsuba as mi
import numpy as np
import pytest
from mlrt_compare.report_page import first_error_scale, first_exposure, packed, report_page
from mlrt_compare.run import Comparison, Side
from mlrt_compare.settings import Settings
from mlrt_compare.timing import Timings
from mlrt_compare.validate import judge

SEED = 20_260_813
HEIGHT, WIDTH = 48, 64
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def images() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two images that differ in one place each way and in a nan, and a cost."""
    second = 4 * exr_images.picture(SEED, HEIGHT, WIDTH)
    first = second.copy()
    first[10, 20] += 0.25
    first[30, 40] -= 0.125
    first[5, 6, 1] = np.nan
    cost = np.arange(HEIGHT * WIDTH, dtype=np.float32).reshape(HEIGHT, WIDTH)
    return first, second, cost


def comparison(*, with_cost: bool = True) -> Comparison:
    mi.set_variant("scalar_rgb")
    first, second, cost = images()
    timings = Timings(0.5, 0.25, 1.5, (1.0, 1.0), kernels_compiled=3, kernels_from_disk=2)
    return Comparison(
        settings=Settings(Path("a <script> & b.xml"), defines={"key": "value"}),
        spp=4,
        shading="native",
        threads=2,
        llvm="20.1.0",
        mlrt=Side("ours", first, Timings(0.5, 0.125, 0.75, (0.5, 0.5))),
        mitsuba=Side("theirs", second, timings),
        verdict=judge(first, second),
        warnings=("a warning",),
        cost=cost if with_cost else None,
    )


MACHINE = {"processor": "a processor", "load": [0.5, 1, 2], "governor": None}


def data_of(page: str) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page)
    data: dict[str, Any] = json.loads(text)
    return data


def unpacked(text: str) -> np.ndarray:
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8)
    return np.ascontiguousarray(planes.reshape(4, -1).T).view("<u4").ravel()


def test_images_are_embedded_bit_for_bit() -> None:
    data = data_of(report_page(comparison(), MACHINE, None))
    first, second, cost = images()
    words = unpacked(data["images"][0])
    assert (words == first.view(np.uint32).ravel()).all()
    assert (words ^ unpacked(data["images"][1]) == second.view(np.uint32).ravel()).all()
    assert (unpacked(data["cost"]) == cost.view(np.uint32).ravel()).all()
    assert (data["width"], data["height"], data["plot"]) == (WIDTH, HEIGHT, None)


def test_the_verdict_says_what_it_is_of() -> None:
    agreeing = comparison()
    same = agreeing.mlrt.image.copy()
    same[~np.isfinite(same)] = 1.0
    sides = {
        name: dataclasses.replace(getattr(agreeing, name), image=same)
        for name in ("mlrt", "mitsuba")
    }
    agreeing = dataclasses.replace(agreeing, **sides, verdict=judge(same, same))
    told = data_of(report_page(agreeing, MACHINE, None))
    pixels = f"{WIDTH * HEIGHT:,}"
    assert told["verdict"].startswith(f"PASS: 0 of {pixels} pixels differ by more than")
    assert data_of(report_page(comparison(), MACHINE, None))["verdict"].startswith("FAIL: ")


def test_equal_images_are_stored_once() -> None:
    noise = np.random.default_rng(SEED).integers(0, 2**32, 10_000, dtype=np.uint32)
    assert len(packed(noise ^ noise)) < 0.01 * len(packed(noise))


def test_nothing_comes_from_elsewhere() -> None:
    page = report_page(comparison(), MACHINE, None)
    without_data = re.sub(r'id="data">.*?</script>', "", page)
    assert "default-src 'none'" in page
    assert not re.search(r'(?:src|href)\s*=\s*["\']|https?:|@import|url\(', without_data)
    assert "a &lt;script&gt; &amp; b.xml" in page and page.count("<script") == 2


@pytest.mark.parametrize(
    ("mean", "stops"), [(0.18, 0), (0.36, -1), (0.045, 2), (0, 0), (1e9, -12)]
)
def test_first_exposure_shows_the_mean_as_middle_grey(mean: float, stops: float) -> None:
    assert first_exposure(np.full((4, 4, 3), mean, np.float32)) == stops


@pytest.mark.parametrize(
    ("largest", "power"), [(0.01, -2), (0.0101, -1.75), (1e-9, -7), (1e9, 1), (0, -2)]
)
def test_first_scale_of_errors_holds_the_largest(largest: float, power: float) -> None:
    first, second = np.zeros((2, 2, 3), np.float32), np.zeros((2, 2, 3), np.float32)
    first[0, 0, 1] = largest
    first[1, 1, 1] = np.nan
    assert first_error_scale(first, second) == power


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip(
        "playwright.sync_api",
        reason="playwright is not installed: pip install 'mlrt[browser]'",
    )
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        pytest.skip("there is no Chromium to open the report page in")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield opened
        opened.close()


@pytest.fixture
def page(browser: Any, tmp_path: Path) -> Iterator[Any]:
    """The report in the browser; messages and requests but for the page itself fail."""
    path = tmp_path / "report.html"
    path.write_text(report_page(comparison(), MACHINE, None))
    opened = browser.new_page(viewport={"width": 1200, "height": 900})
    complaints: list[str] = []
    opened.on("console", lambda message: complaints.append(message.text))
    opened.on("pageerror", lambda error: complaints.append(str(error)))
    opened.on("request", lambda request: complaints.append(request.url))
    opened.goto(path.as_uri())
    opened.wait_for_selector("body[data-ready='true']")
    yield opened
    opened.close()
    assert complaints == [path.as_uri()]


def shown(page: Any) -> np.ndarray:
    """What the canvas holds, (H, W, 4)."""
    values = page.evaluate(
        """() => {
            const canvas = document.getElementById("canvas");
            const context = canvas.getContext("2d");
            return Array.from(
                context.getImageData(0, 0, canvas.width, canvas.height).data);
        }"""
    )
    return np.array(values, np.uint8).reshape(HEIGHT, WIDTH, 4)


def developed(image: np.ndarray, stops: float) -> np.ndarray:
    """8-bit sRGB of an image without nan, by the definition of the curve."""
    linear = np.clip(image.astype(np.float64) * 2.0**stops, 0, 1)
    curved = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055
    )
    return np.rint(255 * curved)


def assert_shows(picture: np.ndarray, image: np.ndarray, stops: float) -> None:
    finite = np.isfinite(image).all(axis=-1)
    expected = developed(np.where(finite[..., None], image, 0), stops)
    assert np.abs(picture[..., :3].astype(float) - expected)[finite].max() <= 1
    assert (picture[~finite] == [255, 0, 255, 255]).all()


def test_flip_key_exposure_and_values(page: Any) -> None:
    first, second, _ = images()
    stops = first_exposure(second)
    assert_shows(shown(page), first, stops)
    page.keyboard.press("f")
    assert_shows(shown(page), second, stops)
    page.keyboard.press("]")
    page.keyboard.press("]")
    assert_shows(shown(page), second, stops + 1)
    page.keyboard.press("f")
    assert_shows(shown(page), first, stops + 1)
    page.locator("#exposure").fill("-3")
    assert_shows(shown(page), first, -3)
    box = page.locator("#canvas").bounding_box()
    page.mouse.move(
        box["x"] + box["width"] * 20.5 / WIDTH, box["y"] + box["height"] * 10.5 / HEIGHT
    )
    told = page.locator("#pixel").inner_text()
    assert "column 20, row 10" in told and "2.50e-1" in told
    assert f"{second[10, 20, 0]:.7g}"[:8] in told


def test_slider_is_dragged(page: Any) -> None:
    first, second, _ = images()
    stops = first_exposure(second)
    page.keyboard.press("s")
    box = page.locator("#canvas").bounding_box()
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, middle)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.25, middle, steps=4)
    page.mouse.up()
    mixed = second.copy()
    mixed[:, : WIDTH // 4] = first[:, : WIDTH // 4]
    assert_shows(shown(page), mixed, stops)
    assert page.locator("#handle").is_visible()


def test_difference_is_of_the_floats(page: Any) -> None:
    page.keyboard.press("d")
    picture = shown(page).astype(int)
    orange, blue = picture[10, 20], picture[30, 40]
    assert orange[0] > orange[2] and blue[2] > blue[0]
    assert (picture[5, 6] == [255, 0, 255, 255]).all()
    picture[[10, 30, 5], [20, 40, 6], :3] = 0
    assert not picture[..., :3].any()
    # A hundredth of the difference for full brightness: both are now as bright as can be.
    page.locator("#error-scale").fill("-3")
    assert shown(page)[10, 20, 0] == shown(page)[30, 40, 2] == 255
    page.locator("#error-kind").select_option("absolute")
    assert (shown(page)[10, 20, :3] == [252, 255, 164]).all()
    assert (shown(page)[0, 0, :3] == [0, 0, 4]).all()


def test_cost_and_zoom(page: Any) -> None:
    page.keyboard.press("c")
    brightness = shown(page)[..., :3].astype(int).sum(axis=-1).ravel()
    assert brightness[0] == 4 and brightness[-1] == brightness.max()
    assert (np.diff(brightness[:: WIDTH * 4]) > 0).all()
    fitted = float(page.evaluate("document.body.dataset.zoom"))
    page.keyboard.press("+")
    assert float(page.evaluate("document.body.dataset.zoom")) == 2 * fitted
    assert page.locator("#canvas").bounding_box()["width"] == pytest.approx(
        2 * fitted * WIDTH, rel=0.01
    )
    page.locator("#zoom-fit").click()
    assert float(page.evaluate("document.body.dataset.zoom")) == pytest.approx(fitted)


def test_without_cost_there_is_no_map_of_it(browser: Any, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    path.write_text(report_page(comparison(with_cost=False), MACHINE, None))
    page = browser.new_page()
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-ready='true']")
    page.keyboard.press("c")
    assert page.evaluate("document.body.dataset.view") == "first"
    assert page.locator("#views button").count() == 4
    page.close()


def test_timings_and_tables_are_told(page: Any) -> None:
    text = page.locator("body").inner_text()
    for words in (
        "FAIL: 1 pixels of the image are not finite",
        "500 ms",
        "2 kernels of earlier runs",
        "a processor",
        "shaded by\tnative",
        "$key",
        "a warning",
        "3 of 3072",
    ):
        assert words in text, words
    widths = [
        bar["width"] for bar in map(lambda b: b.bounding_box(), page.locator(".fill").all())
    ]
    # Rows load, build, JIT, first frame, frame; ours before Mitsuba's.
    assert widths[8] / widths[9] == pytest.approx(0.5, rel=0.02)
    assert widths[6] / widths[7] == pytest.approx(0.5, rel=0.02)
