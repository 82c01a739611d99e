"""A report in a real browser: Debian's chromium, without a window, driven as a person would."""

from __future__ import annotations

import json
import re
import threading
import tomllib
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, HTTPServer
from math import inf, isclose
from pathlib import Path
from typing import Any

import pytest
from selenium import webdriver
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

from solidsph.studies.frontier import Frontier
from solidsph.studies.point import Point
from solidsph.studies.report import write_report
from solidsph.studies.variant import with_settings
from solidsph_cases.csm1 import Csm1
from tests.helpers.browsing import browser, every, one, until
from tests.helpers.reporting import HOSTILE, OfFunctions, hostile, known

__all__ = ["browser"]  # a fixture

pytestmark = pytest.mark.browser

MARKS = ".scatterlayer .points path.point"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "known.html"
    write_report(known(), Csm1(), path)
    return path


@pytest.fixture
def report(browser: webdriver.Chrome, page: Path) -> webdriver.Chrome:
    return opened(browser, page)


def opened(browser: webdriver.Chrome, path: Path) -> webdriver.Chrome:
    browser.get_log("browser")  # of the page before
    browser.get_log("performance")
    browser.get(path.as_uri())
    until(browser, lambda: browser.execute_script("return document.documentElement.dataset.ready"))
    return browser


def moving(browser: webdriver.Chrome) -> ActionChains:
    return ActionChains(browser, duration=0)  # the pointer leaps


def column(browser: webdriver.Chrome, heading: str) -> Sequence[str]:
    """Texts of a column, in the rows that are seen."""
    found: Sequence[str] = browser.execute_script(
        """
        const [wanted] = arguments;
        const headings = [...document.querySelectorAll("#points thead th")];
        const place = headings.findIndex((one) => one.textContent === wanted);
        const rows = [...document.querySelectorAll("#points tbody tr")];
        return rows.filter((row) => !row.hidden).map((row) => row.cells[place].textContent);
        """,
        heading,
    )
    return found


def press(browser: webdriver.Chrome, heading: str) -> None:
    for button in every(browser, "#points thead button"):
        if button.text.startswith(heading):
            button.click()


def complaints(browser: webdriver.Chrome) -> Sequence[Any]:
    return [line for line in browser.get_log("browser") if line["level"] in ("SEVERE", "WARNING")]


def requested(browser: webdriver.Chrome) -> Sequence[str]:
    """By the page that is open; the browser's own pages, such as that of a new tab, are not it."""
    events = [json.loads(line["message"])["message"] for line in browser.get_log("performance")]
    return [
        event["params"]["request"]["url"]
        for event in events
        if event["method"] == "Network.requestWillBeSent"
        and event["params"]["documentURL"] == browser.current_url
    ]


def spoken(browser: webdriver.Chrome) -> str:
    """What the label under the pointer says; nothing if there is none."""
    text: str = browser.execute_script(
        "return document.querySelector('#by-cost .hoverlayer .hovertext')?.textContent ?? ''"
    )
    return text


def ring(browser: webdriver.Chrome, plot: str) -> tuple[list[float], list[float]]:
    """Where a plot rings the chosen point."""
    x, y = browser.execute_script(
        "const ring = document.getElementById(arguments[0]).data.at(-1); return [ring.x, ring.y]",
        plot,
    )
    return x, y


def test_it_opens_without_complaint_and_asks_nothing_of_a_network(
    report: webdriver.Chrome, page: Path
) -> None:
    asked = requested(report)
    assert asked[0] == page.as_uri()  # or the log would show nothing
    assert [url for url in asked[1:] if not url.startswith(("data:", "blob:"))] == []
    assert complaints(report) == []
    assert one(report, "#sentence").text == known().sentence()


def test_it_cannot_ask_a_network(report: webdriver.Chrome) -> None:
    asked = []

    class Listener(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_error(404)

        def log_message(self, *words: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Listener) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        told = report.execute_async_script(
            """
            const [place, done] = arguments;
            const image = new Image();
            const failed = new Promise((then) => (image.onload = image.onerror = then));
            image.src = `${place}/image`;
            const fetched = fetch(`${place}/fetch`, { mode: "no-cors" }).then(
              () => "heard", () => "refused");
            Promise.all([fetched, failed]).then(([word]) => done(word));
            """,
            f"http://127.0.0.1:{server.server_port}",
        )
        server.shutdown()
    assert told == "refused"
    assert asked == []
    # Nor does anything offer to send it somewhere.
    buttons = every(report, ".modebar-btn")
    titles = {button.get_attribute("data-title") for button in buttons}
    assert "Zoom" in titles
    assert [title for title in titles if re.search("share|cloud|edit", title, re.IGNORECASE)] == []
    links = [link.get_attribute("href") for link in every(report, "a[href]")]
    assert [link for link in links if link.startswith("http")] == []


def test_as_many_points_are_drawn_as_finished(report: webdriver.Chrome) -> None:
    finished = len(known().finished())
    assert len(every(report, f"#by-cost {MARKS}")) == finished
    assert len(every(report, f"#by-spacing {MARKS}")) == finished
    assert len(every(report, "#points tbody tr")) == len(known())


def test_a_row_shows_its_scene(report: webdriver.Chrome) -> None:
    assert every(report, "#scenes pre") == []
    for number in (1, 4, 6):
        every(report, "#points tbody tr")[number].find_elements(By.TAG_NAME, "td")[2].click()
        (scene,) = with_settings(Csm1(), known().points[number].settings).scenes().values()
        (shown,) = every(report, "#scenes pre")
        assert shown.get_property("textContent") == scene.to_toml()
        assert known().points[number].label() in one(report, "#chosen").text
        chosen = every(report, "#points tr[aria-current]")
        assert [row.get_attribute("data-point") for row in chosen] == [str(number)]
    assert ring(report, "by-cost") == ([], [])  # the last of them failed and is not drawn
    assert complaints(report) == []


def test_a_point_of_the_plot_shows_its_scene_and_says_what_it_is(report: webdriver.Chrome) -> None:
    points = known().points
    seen = set()
    for mark in every(report, f"#by-cost {MARKS}"):
        moving(report).move_to_element(mark).perform()
        label = until(report, lambda: spoken(report))
        moving(report).click().perform()
        number = int(one(report, "#scene-heading").text.split()[-1]) - 1
        point = points[number]
        (scene,) = with_settings(Csm1(), point.settings).scenes().values()
        assert one(report, "#scenes pre").get_property("textContent") == scene.to_toml()
        until(report, lambda point=point: ring(report, "by-cost")[0] == [point.time])
        assert ring(report, "by-spacing")[0] == [point.spacing]
        assert isclose(ring(report, "by-cost")[1][0], 100.0 * point.error)
        for name, value in point.settings.items():
            assert f"{name}: {value}" in label
        assert f"{point.time:.3g} s" in label
        seen.add(number)
        one(report, "h1").click()  # away from it
        until(report, lambda: not spoken(report))
    assert seen == {0, 1, 2, 3, 4, 5}
    report.execute_script("window.scrollTo(0, 0)")


def test_a_click_on_a_heading_sorts(report: webdriver.Chrome) -> None:
    rising = sorted(100.0 * point.error for point in known().finished())
    press(report, "error [%]")
    assert column(report, "error [%]") == [*(f"{error:.3g}" for error in rising), ""]
    press(report, "error [%]")  # what has no error stays last
    assert column(report, "error [%]") == [*(f"{error:.3g}" for error in rising[::-1]), ""]
    press(report, "across")  # as numbers: 5 before 13
    assert column(report, "across") == ["5", "5", "9", "9", "13", "13", "17"]
    press(report, "gradient")
    assert column(report, "gradient") == ["consistent"] * 4 + ["quadratic"] * 3
    sorts = [h.get_attribute("aria-sort") for h in every(report, "#points thead th")]
    assert [one for one in sorts if one] == ["ascending"]
    press(report, "no.")
    press(report, "no.")
    assert column(report, "no.") == list("7654321")
    every(report, "#points tbody tr")[0].click()  # rows keep their scenes wherever they are
    assert known().points[6].label() in one(report, "#chosen").text


def test_the_box_filters(report: webdriver.Chrome) -> None:
    box = one(report, "#filter")
    assert one(report, "#count").text == "7 of 7"
    box.send_keys("quadratic")
    assert column(report, "gradient") == ["quadratic"] * 3
    assert one(report, "#count").text == "3 of 7"
    box.send_keys(" 13")
    assert column(report, "across") == ["13"]
    box.clear()
    box.send_keys("DIVERGED")
    assert column(report, "across") == ["17"]
    box.clear()
    box.send_keys("nowhere")
    assert column(report, "across") == []
    box.send_keys(Keys.CONTROL, "a", Keys.DELETE)
    assert len(column(report, "across")) == 7


def test_the_cost_is_chosen_by_buttons(report: webdriver.Chrome) -> None:
    made = known()

    def title() -> str:
        return one(report, "#by-cost .xtitle").text

    def front() -> set[int]:
        return {int(n) - 1 for n, f in zip(*columns(), strict=True) if f == "front"}

    def columns() -> tuple[Sequence[str], Sequence[str]]:
        return column(report, "no."), column(report, "front")

    assert title() == "wall time [s]"
    assert front() == {made.points.index(point) for point in made.front()}
    for number, heading, of in (
        (1, "pair evaluations [-]", lambda p: p.pair_evaluations),
        (2, "peak memory [MiB]", lambda p: p.peak_memory),
        (0, "wall time [s]", lambda p: p.time),
    ):
        button = every(report, "[data-expense]")[number]
        button.click()
        until(report, lambda heading=heading: title() == heading)
        assert front() == {made.points.index(point) for point in made.front(of)}
        pressed = every(report, '[data-expense][aria-pressed="true"]')
        assert [one.text for one in pressed] == [button.text]
        assert len(every(report, f"#by-cost {MARKS}")) == 6
    assert complaints(report) == []


def test_a_keyboard_is_enough(report: webdriver.Chrome) -> None:
    reached = []
    while "7" not in reached:
        assert len(reached) < 100
        moving(report).send_keys(Keys.TAB).perform()
        reached.append(
            report.execute_script(
                "const there = document.activeElement; return there.id || there.textContent"
            )
        )
    wanted = ("wall time", "pair evaluations", "peak memory", "filter", "error [%]", "1", "7")
    places = [next(n for n, t in enumerate(reached) if t.startswith(word)) for word in wanted]
    assert places == sorted(places)
    every(report, "#points tbody button")[2].send_keys(Keys.ENTER)
    assert known().points[2].label() in one(report, "#chosen").text
    every(report, "#points thead button")[2].send_keys(Keys.SPACE)
    assert column(report, "across")[0] == "5"


def test_a_scene_is_copied_and_downloaded(report: webdriver.Chrome, tmp_path: Path) -> None:
    report.execute_cdp_cmd(
        "Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)}
    )
    every(report, "#points tbody button")[3].click()
    (scene,) = with_settings(Csm1(), known().points[3].settings).scenes().values()
    one(report, "#scenes a.button").click()
    saved = tmp_path / "csm1-4.toml"
    until(report, lambda: saved.exists() and saved.stat().st_size > 0)
    assert saved.read_text(encoding="utf-8") == scene.to_toml()
    one(report, "#scenes button").click()
    until(report, lambda: one(report, "#scenes button").text == "Copied")
    # A click may write; to read needs leave.
    wanted = {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]}
    report.execute_cdp_cmd("Browser.grantPermissions", wanted)
    copied = report.execute_async_script(
        "navigator.clipboard.readText().then(arguments[0], arguments[0])"
    )
    assert copied == scene.to_toml()
    assert complaints(report) == []


def test_hostile_words_are_words(browser: webdriver.Chrome, tmp_path: Path) -> None:
    write_report(hostile(), Csm1(), tmp_path / "hostile.html", title=HOSTILE)
    report = opened(browser, tmp_path / "hostile.html")
    assert one(report, "h1").get_property("textContent") == f"{HOSTILE}: what accuracy costs"
    assert HOSTILE in one(report, "#by-cost .ytitle").get_property("textContent")
    mark = every(report, f"#by-cost {MARKS}")[0]
    moving(report).move_to_element(mark).perform()
    assert f"kernel: {HOSTILE}" in until(report, lambda: spoken(report))
    moving(report).click().perform()
    scene = tomllib.loads(one(report, "#scenes pre").get_property("textContent"))
    assert scene["kernel"]["type"] == HOSTILE
    assert report.execute_script("return window.hit") is None
    assert complaints(report) == []


def test_it_is_no_wider_than_the_window(report: webdriver.Chrome) -> None:
    every(report, "#points tbody button")[0].click()
    for width in (600, 1400):
        report.set_window_size(width, 900)

        def fits(width: int = width) -> bool:
            seen, wanted = report.execute_script(
                "const page = document.documentElement; return [page.clientWidth, page.scrollWidth]"
            )
            plots = [plot.size["width"] for plot in every(report, ".plot .main-svg")]
            return (
                width - 40 < seen <= width  # but for the bar to scroll with
                and wanted <= seen
                and all(0.4 * width < one < width for one in plots)
            )

        until(report, fits)


def test_a_sweep_of_failures_shows_what_scenes_there_are(
    browser: webdriver.Chrome, tmp_path: Path
) -> None:
    refused = Point({"across": 1, "gradient": "consistent"}, inf, "refused")
    failed = Frontier([known().points[-1], refused], "across")
    write_report(failed, OfFunctions(), tmp_path / "failed.html")
    report = opened(browser, tmp_path / "failed.html")
    assert "no configuration finished: diverged" in one(report, "#sentence").text
    assert "diverged at step 120\nof 170" in one(report, "#failures").text
    assert every(report, f"#by-cost {MARKS}") == []
    wanted, unwanted = every(report, "#points tbody button")
    wanted.click()
    assert [shown.text for shown in every(report, "#scenes h3")] == ["plain", "moved"]
    assert len(every(report, "#scenes pre")) == 1
    assert "cannot be written" in one(report, "#scenes").text
    unwanted.click()
    assert "There is no scene: " in one(report, "#scenes").text
    assert complaints(report) == []
