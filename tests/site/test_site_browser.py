"""The built site in a real browser, as narrow as a telephone and as wide as a desk."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.common.keys import Keys

from tests.helpers.browsing import browser, every, one, until
from tests.site.contents import DOCS, ROOT, reached

__all__ = ["browser"]  # a fixture

pytestmark = [pytest.mark.browser, pytest.mark.validation]

SITE = ROOT / "build/site"
NARROW, WIDE = 400, 1400  # [px]


@pytest.fixture(scope="module")
def site() -> Path:
    if not (SITE / "index.html").exists():
        pytest.fail("the site is not built; run `make docs`", pytrace=False)
    return SITE


def _set_width(driver: webdriver.Chrome, width: int) -> None:
    """Of the page; a window without a head is not as narrow as that."""
    metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def _sticking_out(driver: webdriver.Chrome) -> Sequence[str]:
    """What ends beyond the window and does not scroll in place, so that the whole page does."""
    found: Sequence[str] = driver.execute_script(
        """
        const width = document.documentElement.clientWidth;
        const right = (one) => one.getBoundingClientRect().right;
        const scrolls = (one) => ["auto", "scroll"].includes(getComputedStyle(one).overflowX);
        const isKept = (one) => {
            while ((one = one.parentElement) && one.tagName !== "ARTICLE")
                if (scrolls(one) && right(one) <= width + 1) return true;
            return false;
        };
        return [...document.querySelectorAll("article *")]
            .filter((one) => right(one) > width + 1 && !isKept(one))
            .map((one) => one.outerHTML.slice(0, 120)).slice(0, 5);
        """
    )
    return found


@pytest.mark.parametrize("width", [NARROW, WIDE])
@pytest.mark.parametrize("page", sorted(reached()))
def test_it_is_no_wider_than_the_window_and_its_pictures_are_there(
    browser: webdriver.Chrome, site: Path, page: str, width: int
) -> None:
    _set_width(browser, width)
    browser.get((site / f"{page}.html").as_uri())
    assert _sticking_out(browser) == []
    missing = browser.execute_script(
        """
        const pictures = [...document.querySelectorAll("article img")];
        pictures.forEach((one) => { one.loading = "eager"; });
        return Promise.all(pictures.map((one) => one.decode().then(() => null, () => one.src)))
            .then((sources) => sources.filter((source) => source));
        """
    )
    assert missing == []


def test_what_sticks_out_is_seen(browser: webdriver.Chrome, site: Path) -> None:
    _set_width(browser, NARROW)
    browser.get((site / "index.html").as_uri())
    browser.execute_script("document.querySelector('article h1').style.width = '500px'")
    assert [text[:3] for text in _sticking_out(browser)] == ["<h1"]


@pytest.mark.parametrize("width", [NARROW, WIDE])
def test_the_search_finds_a_word(browser: webdriver.Chrome, site: Path, width: int) -> None:
    _set_width(browser, width)
    browser.get((site / "search.html").as_uri() + "?q=hourglass")
    until(browser, lambda: every(browser, "#search-results li a"))
    texts = [link.text for link in every(browser, "#search-results li a")]
    assert any("Hourglass control" in text for text in texts)


def test_the_box_beside_the_page_leads_to_the_search(browser: webdriver.Chrome, site: Path) -> None:
    _set_width(browser, WIDE)
    browser.get((site / "index.html").as_uri())
    one(browser, ".sidebar-search").send_keys("Howland", Keys.ENTER)
    until(browser, lambda: every(browser, "#search-results li a"))
    assert "plate with a hole" in one(browser, "#search-results").text


def test_tutorials_show_their_pictures(site: Path) -> None:
    for page in sorted((DOCS / "tutorials").glob("*.md")):
        text = (site / f"tutorials/{page.stem}.html").read_text(encoding="utf-8")
        shown = text.count('<img alt="../_images/')
        assert page.stem in {"index", "own-kernel"} or shown >= 1, page.stem


def test_equations_lead_to_their_source(browser: webdriver.Chrome, site: Path) -> None:
    browser.get((site / "theory.html").as_uri())
    link = one(browser, 'article a[href*="Consistent"]')
    browser.get(link.get_property("href"))
    anchor = browser.current_url.partition("#")[2]
    entry = browser.execute_script("return document.getElementById(arguments[0])", anchor)
    assert "Consistent" in entry.text
