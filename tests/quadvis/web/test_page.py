# ruff: noqa: RUF001
"""The page in a real browser, in front of a real run."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from quadvis.api import Diagram, load
from tests.quadvis.web.browser import CHROMIUM, Browser
from tests.quadvis.web.running import Running
from tests.quadvis.web.stand_in import StandIn

ROOT = Path(__file__).parents[3]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here"),
]
WIRE = "document.querySelector('g.wire[data-source=\"{}\"]')"
# A point on a wire, in pixels of the screen: the middle of its first stretch.
POINT = """(() => {{
  const line = {wire}.querySelector('polyline.reach'), [one, two] = [...line.points], m = line.getScreenCTM();
  return [(one.x + two.x) / 2 * m.a + m.e, (one.y + two.y) / 2 * m.d + m.f];
}})()"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    made = Browser(tmp_path_factory.mktemp("browser"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def hover() -> Diagram:
    return load(ROOT / "diagrams" / "hover.yaml", stop_time="1000 s")


@pytest.fixture
def target(hover: Diagram, tmp_path: Path) -> Iterator[StandIn]:
    made = StandIn(
        hover, tmp_path, others={"geometric": load(ROOT / "diagrams/hover.yaml", variant="geometric")}
    )
    made.do_drawing()
    yield made
    made.close()


@pytest.fixture
def running(target: StandIn, browser: Browser) -> Iterator[Running]:
    made = Running(target)
    browser.complaints.clear()
    yield made
    made.close()
    browser.do("Page.navigate", url="about:blank")


def opened(browser: Browser, running: Running, **size: int | bool) -> None:
    browser.open(running.gateway.address, **size)  # type: ignore[arg-type]
    browser.until("document.querySelectorAll('g.wire').length > 20")


def test_a_flight_from_start_to_stop(browser: Browser, running: Running, target: StandIn) -> None:
    opened(browser, running)
    assert running.gateway.access.token not in browser.run("location.href")  # no history keeps it
    assert browser.text("#state") == "stopped"
    browser.click_on("#start")
    browser.until("document.querySelector('#state').innerText === 'running'")
    # values move, with their units
    browser.until(
        "[...document.querySelectorAll('.value')].some((each) => / (m|rad|N)$/.test(each.textContent))"
    )
    before = browser.text("#clock")
    shown = "[...document.querySelectorAll('.value')].map((each) => each.textContent).join()"
    first = browser.run(shown)
    browser.until(lambda: browser.run(shown) != first and browser.text("#clock") != before)
    # a click on a wire opens a scope, a second signal comes to it
    browser.click(*browser.run(POINT.format(wire=WIRE.format("craft.attitude"))))
    browser.until("!document.querySelector('#scope').hidden")
    assert browser.text(".signals").split() == [f"craft.attitude[{axis}]" for axis in range(3)]
    browser.until(lambda: browser.page("page.scope.data.count") > 200)
    curves = browser.page("page.scope.data.between(0, 1e9).map((list) => list.slice(-100))")
    assert all(later - sooner < 0.006 for sooner, later in pairwise(curves[0]))
    browser.page("page.scope.toggle('control/mixer.thrust')")
    browser.until(lambda: browser.page("page.scope.data.count > 50 && page.scope.data.width === 7"))
    # space pauses, and goes on
    browser.run("document.querySelector('#drawing').focus()")
    browser.key(" ", "Space", 32, " ")
    assert browser.page("page.scope.paused") is True
    browser.key(" ", "Space", 32, " ")
    assert browser.page("page.scope.paused") is False
    # the camera shows what was found
    browser.until("/^4 found/.test(document.querySelector('.found').innerText)")
    assert browser.text("#modes").split("\n")[-1] == "four circles"
    # a parameter, first a wrong value, then a right one
    browser.click_on('g.block[data-path="control/roll"] > rect')
    browser.until("document.querySelectorAll('.parameter input').length > 0")
    assert "Roll (or pitch) torque" in browser.until("document.querySelector('#block .doc').innerText")
    for value, note in (("-3 rad/s", "bandwidth"), ("2.5 rad/s", "holds from tick")):
        browser.click_on("input[aria-label='control/roll.bandwidth']")
        browser.run("document.activeElement.select()")
        browser.type(value)
        browser.key("Enter", "Enter", 13, "\r")
        browser.until(lambda note=note: note in browser.text("form.held .note, form.refused .note"))
    assert [change.value for change in target._flight.run.changes] == [2.5]  # type: ignore[union-attr]
    # how long its calls take, of all blocks as much
    browser.click_on("#block > button")
    browser.until("document.querySelectorAll('#block .calls td').length === 4")
    count = len(target.profiled or ())
    assert browser.text("#block .calls").split("\n")[-1].split("\t") == [
        "output", "20.0 µs", "30.0 µs", f"{100 / count:.1f} %",
    ]  # fmt: skip
    assert target.asked[-1] == "getprofilerdata"
    # Esc closes the block, then the scope
    browser.run("document.activeElement.blur()")
    browser.key("Escape", "Escape", 27)
    browser.until("document.querySelector('#block').hidden")
    browser.key("Escape", "Escape", 27)
    browser.until("document.querySelector('#scope').hidden")
    browser.until(lambda: not target.scopes)
    # stop: verdicts and the recording
    browser.click_on("#stop")
    browser.until("document.querySelector('#state').innerText === 'stopped'")
    browser.until("document.querySelectorAll('#verdicts li').length > 5")
    browser.until("/hover-1/.test(document.querySelector('#logs').innerText)")
    events = browser.text("#events")
    assert (
        "started" in events
        and "stopped" in events
        and "control/roll.bandwidth: 2.0 rad/s → 2.5 rad/s" in events
    )
    assert browser.complaints == []


def test_a_triggered_acquisition_stands_still(browser: Browser, running: Running, target: StandIn) -> None:
    target.do_start()
    opened(browser, running)
    browser.page("(page.scope.toggle('craft.attitude'), page.scope.adjust({mode: 'Software', window: 1}))")
    browser.until(lambda: [scope.status for scope in target.scopes.values()] == ["Acquiring"])
    assert browser.page("page.scope.data.count") == 0
    browser.run(
        "[...document.querySelectorAll('.controls button')].find((b) => b.innerText === 'Trigger').click()"
    )
    browser.until(lambda: browser.page("page.scope.data.count") == 200)
    browser.page("page.scope.adjust({mode: 'Signal', signal: 'craft.attitude[0]', level: 0})")
    browser.until(lambda: browser.page("page.scope.data.count") == 200)
    at, times, roll = browser.page(
        "[page.scope.at, page.scope.data.between(0, 1e9)[0], page.scope.data.between(0, 1e9)[1]]"
    )
    index = min(range(200), key=lambda number: abs(times[number] - at))
    assert index == 40 and roll[index - 1] < 0 <= roll[index]  # a fifth lies before the trigger
    assert browser.complaints == []


def test_a_lost_connection_is_greyed_and_comes_back(
    browser: Browser, running: Running, target: StandIn
) -> None:
    target.do_start()
    opened(browser, running)
    browser.until("document.body.dataset.connection === 'live'")
    browser.page("page.scope.toggle('craft.position')")
    browser.until(lambda: browser.page("page.scope.data.count") > 20)
    # the target falls silent, the gateway is there
    target.silent = True
    since = time.monotonic()
    browser.until("document.body.dataset.connection === 'old'")
    print(f"greyed after {time.monotonic() - since:.2f} s")
    browser.until("/no news for [1-9]/.test(document.querySelector('#connection').innerText)")
    target.silent = False
    browser.until("document.body.dataset.connection === 'live'")
    for viewer in list(running.gateway.viewers):  # as if the way to it was cut
        running._loop.call_soon_threadsafe(viewer.give_up)
    browser.until(lambda: "the connection is lost" in browser.text("#events"))
    browser.until("document.body.dataset.connection === 'live'")
    browser.until(lambda: browser.page("page.scope.data.count") > 100)
    browser.until(lambda: len(target.scopes) >= 1)  # the page has its scope again


def test_another_application_is_loaded(browser: Browser, running: Running, target: StandIn) -> None:
    opened(browser, running)
    browser.until("!document.querySelector('#load').hidden")
    browser.until("document.querySelectorAll('g.block[data-path=\"eyes/detector\"]').length === 1")
    browser.run("document.querySelector('#choice').value = 'geometric'")
    browser.click_on("#load")
    browser.until("document.querySelectorAll('g.block[data-path=\"eyes/detector\"]').length === 0")
    assert browser.run("document.querySelector('#camera').hidden") is True


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_each_level_sees_what_it_may(browser: Browser, running: Running, target: StandIn, level: int) -> None:
    target.level = level
    target.do_start()
    browser.open(running.gateway.address)
    browser.until("document.querySelector('#state').innerText === 'running'")
    controls = "[...document.querySelectorAll('button, input, select')]"
    visible = f"{controls}.filter((each) => each.offsetParent).map((each) => each.id)"
    if level == 4:
        browser.until("document.querySelectorAll('.task').length === 4")
        assert browser.run(visible) == [] and "nothing to show" in browser.text("#drawing")
        return
    browser.until("document.querySelectorAll('g.wire').length > 20")
    browser.until("[...document.querySelectorAll('.value')].some((each) => each.textContent)")
    assert ("stop" in browser.run(visible)) == (level == 1)
    assert "load" not in browser.run(visible)
    browser.page("page.drawing.onblock('control/roll')")
    browser.until("!document.querySelector('#block').hidden")
    assert browser.run("document.querySelectorAll('.parameter').length > 0") == (level <= 2)
    assert browser.run("document.querySelectorAll('.parameter input').length") == 0
    browser.page("page.scope.toggle('craft.position')")
    browser.until(lambda: browser.page("page.scope.data.count") > 5)
    assert bool(target.scopes) == (level <= 2)
    assert browser.complaints == []


def test_a_phone_shows_state_and_stop_first_and_pans(
    browser: Browser, running: Running, target: StandIn
) -> None:
    target.do_start()
    opened(browser, running, width=390, height=844, mobile=True)
    browser.until("!document.querySelector('#stop').hidden && !document.querySelector('#modes').hidden")
    tops = browser.run(
        "['#state', '#stop', '#modes', '#middle']"
        ".map((each) => document.querySelector(each).getBoundingClientRect().top)"
    )
    assert tops == sorted(tops) and tops[2] < 200
    assert browser.run("document.documentElement.scrollWidth") <= 390
    before = browser.page("[page.drawing.view.x, page.drawing.view.scale]")
    box = browser.run("(({x, y}) => [x, y])(document.querySelector('#drawing').getBoundingClientRect())")
    apart = [{"x": 150 + box[0], "y": 150 + box[1], "id": 1}, {"x": 230 + box[0], "y": 150 + box[1], "id": 2}]
    browser.do("Input.dispatchTouchEvent", type="touchStart", touchPoints=apart)
    for step in range(1, 6):
        apart[1] = {**apart[1], "x": 230 + box[0] + 15 * step}
        browser.do("Input.dispatchTouchEvent", type="touchMove", touchPoints=apart)
    browser.do("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    assert browser.page("page.drawing.view.scale") > 1.5 * before[1]
    assert browser.complaints == []


def test_from_afar_names_stand_in_the_middle_and_no_value_hides_them(
    browser: Browser, running: Running
) -> None:
    opened(browser, running)
    browser.click_on("#start")
    browser.until("[...document.querySelectorAll('.value')].filter((each) => each.textContent).length > 5")
    assert browser.run("document.querySelector('#drawing svg').classList.contains('far')")
    boxes = """(selector) => [...document.querySelectorAll(selector)].map((each) => {
      const { left, right, top, bottom } = each.getBoundingClientRect();
      return [left, right, top, bottom];
    })"""
    name, outline = (
        browser.run(f"({boxes})('.block[data-path=\"control/roll\"] > .{each}')")[0]
        for each in ("name", "outline")
    )
    middle, height = (outline[2] + outline[3]) / 2, outline[3] - outline[2]
    assert abs((name[2] + name[3]) / 2 - middle) < 0.15 * height
    solid = browser.run(f"({boxes})('.block > .outline, .part > text')")
    values = [box for box in browser.run(f"({boxes})('.value')") if box[1] > box[0]]
    assert len(values) > 5
    for left, right, top, bottom in values:
        most = top + 0.3 * (bottom - top), bottom - 0.3 * (bottom - top)  # type is less high than its box
        for begin, end, upper, lower in solid:
            assert right <= begin or left >= end or most[1] <= upper or most[0] >= lower


def test_a_drawing_brings_no_script_into_the_page(
    browser: Browser, running: Running, target: StandIn
) -> None:
    drawing = target.do_drawing()
    evil = (
        '<script>window.evil = 1</script><a href="javascript:evil()"><rect onclick="evil()"/></a>'
        '<image href="x" onerror="evil()"/><foreignObject><p>x</p></foreignObject>'
    )
    target.picture = drawing.replace('<g class="block"', f'{evil}<g onclick="evil()" class="block"')
    opened(browser, running)
    assert (
        browser.run(
            "document.querySelectorAll("
            "'#drawing :is(script, a, image, foreignObject, [onclick], [href])').length"
        )
        == 0
    )
    assert browser.run("window.evil") is None


def test_numbers_and_words_are_made_for_people(browser: Browser, running: Running) -> None:
    opened(browser, running)
    code = """Promise.all([import('/format.js'), import('/words.js')]).then(([f, w]) => ({
      numbers: [0, 1.5, -0.02345, 123.456, 4321.2, 2e-7, 31e6, 'NaN', '-Infinity'].map(f.number),
      units: ['m/s^2', 'rad/s^1.5', '1', 'm^-1', ''].map(f.unit),
      vector: f.value({unit: 'm', type: 'float64'}, [1, 2, 3, 4, 5, 6]),
      flags: f.value({unit: '1', type: 'bool'}, [true, false]),
      word: f.value(
        {unit: '1', type: 'int64', words: w.words('mode', '0 MANUAL, 1 MIXED, 2 AUTOMATIC', '')}, 2),
      table: [...w.words('reason', 'reason for the mode: 0 to 13, see above',
        'x\\n\\n=== ==\\nreason meaning\\n=== ==\\n3   the IMU is stale\\n10  frozen\\n=== ==\\n')],
      none: w.words('count', 'how often, 0 to 3', '').size,
    }))"""
    assert browser.run(code) == {
        "numbers": ["0", "1.500", "−0.023", "123.5", "4321", "2.0e−7", "3.1e7", "missing", "−∞"],
        "units": ["m/s²", "rad/s¹⋅⁵", "", "m⁻¹", ""],
        "vector": "[1.000 2.000 3.000 4.000 … (6)] m",
        "flags": "●○",
        "word": "AUTOMATIC",
        "table": [[3, "the IMU is stale"], [10, "frozen"]],
        "none": 0,
    }
