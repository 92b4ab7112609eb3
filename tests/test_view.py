"""The interactive view: one file that asks for nothing, holds the surface, and is drawn by a browser."""

import base64
import json
import re
from functools import cache
from html import unescape
from importlib.resources import files

import numpy as np
import pytest
from browser import BROWSER, opened

import der
from compare.report.html import page as report
from compare.report.section import Picture, Section
from ribbonfem import Scene, elastica
from ribbonfem.output.curve import Curve
from ribbonfem.output.page import page, view
from ribbonfem.output.surface import of_motion

SCENE = Scene(compression=0.40, shear=0.40, rate=0.5, damping=1.0, stop=np.pi)
# hands on the page: keys, a finger, the slider; and what was seen after each
HANDS = """
(async () => {
  const at = (kind, more) => canvas.dispatchEvent(new PointerEvent(kind, { isPrimary: true, ...more }));
  const key = (name) => canvas.dispatchEvent(
    new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true }));
  const later = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  // a drawing buffer is kept to the end of the task that draws
  const seen = async () => { await later(); paint(); return canvas.toDataURL(); };
  const mark = () => document.querySelector("circle").getAttribute("cx");
  canvas.setPointerCapture = () => {};
  const pictures = [await seen()], before = mark();
  const blank = document.createElement("canvas");
  [blank.width, blank.height] = [canvas.width, canvas.height];
  key("ArrowLeft");
  pictures.push(await seen());
  at("pointerdown", { clientX: 10, clientY: 50 });
  at("pointermove", { clientX: 90, clientY: 50 });
  at("pointerup");
  pictures.push(await seen());
  slider.value = 3;
  slider.dispatchEvent(new Event("input"));
  pictures.push(await seen());
  const words = said.textContent, after = mark(), start = performance.now();
  for (let k = 0; k < 10; k++) { stale = true; await later(); }
  const cost = (performance.now() - start) / 20;
  key(" ");
  const going = button.textContent;
  key(" ");
  return {
    drawn: canvas.dataset.drawn, different: new Set([blank.toDataURL(), ...pictures]).size, words, going,
    stopped: button.textContent, marked: before !== after, cost,
    wide: document.documentElement.scrollWidth, screen: document.documentElement.clientWidth,
  };
})()"""


@cache
def motion():
    return der.simulate(SCENE, until="snap", nodes=51)


@cache
def curve():
    return Curve.of(der.equilibria(SCENE, nodes=51))


def payload(text):
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])


def test_it_is_one_file_that_asks_no_host_and_is_small(tmp_path):
    path = view(motion(), tmp_path / "below" / "v.html", curve())
    text = path.read_text(encoding="utf-8")
    assert path.stat().st_size < 2e6
    for outside in ("http:", "https:", "src=", "import ", "fetch(", "url(http", "[[title]]", "[[code]]"):
        assert outside not in text, outside
    assert [each.name for each in path.parent.iterdir()] == ["v.html"]
    # of very many instants fewer nodes are shown
    large = page(motion(), curve(), frames=3000)
    assert len(large) < 10e6
    data = payload(large)
    points = np.frombuffer(base64.b64decode(data["points"]), "<f4").reshape(3000, 2, data["nodes"], 3)
    np.testing.assert_allclose(
        points[:, :, [0, -1]], of_motion(motion(), 3000).edges[:, :, [0, -1]], atol=1e-7
    )


def test_its_payload_is_the_surface_of_the_motion():
    data = payload(page(motion(), curve(), frames=7))
    strip = of_motion(motion(), 7)
    points = np.frombuffer(base64.b64decode(data["points"]), "<f4")
    np.testing.assert_allclose(points.reshape(7, 2, data["nodes"], 3), strip.edges, atol=1e-7)
    for name in ("time", "angle", "height"):
        np.testing.assert_allclose(data[name], getattr(strip, name), atol=1e-6)
    assert data["state"][0] == "U+S+"
    reach = np.linalg.norm(points.reshape(-1, 3) - data["centre"], axis=1)
    assert reach.max() == pytest.approx(data["radius"], rel=1e-5)


def test_a_control_that_is_no_angle_is_named_with_its_unit():
    assert (payload(page(motion(), frames=2))["name"], payload(page(motion(), frames=2))["unit"]) == (
        "α",
        "rad",
    )
    lifted = der.simulate(Scene(drive="lift", rate=0.05, stop=0.01), nodes=21)
    data = payload(page(lifted, frames=2))
    assert (data["name"], data["unit"]) == ("lift", "L")
    code = (files("ribbonfem") / "output" / "page.js").read_text(encoding="utf-8")
    assert "rad" not in re.sub(r"radius|gradient", "", code)


def test_the_curve_is_whole_and_its_stable_parts_are_solid():
    parts = payload(page(motion(), curve(), frames=2))["curve"]
    assert [part["rows"][-1] for part in parts[:-1]] == [part["rows"][0] for part in parts[1:]]
    assert sum(len(part["rows"]) - 1 for part in parts) == len(curve().angle) - 1
    assert {part["stable"] for part in parts} == {True, False}
    branch = elastica.equilibria(Scene(shear=0.0, start="U+"))
    assert payload(page(motion(), branch, frames=2))["curve"]
    assert payload(page(motion(), frames=2))["curve"] == []


def test_what_cannot_be_shown_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"\.html"):
        view(motion(), tmp_path / "v.htm")
    bare = der.simulate(SCENE, until="snap", configurations=False, nodes=51)
    with pytest.raises(ValueError, match="configurations"):
        view(bare, tmp_path / "v.html")
    with pytest.raises(ValueError, match="frames = 1"):
        view(motion(), tmp_path / "v.html", frames=1)
    assert not list(tmp_path.iterdir())


def test_the_report_has_it_within_and_keeps_it_apart(tmp_path):
    text = view(motion(), tmp_path / "run-view.html", frames=2).read_text(encoding="utf-8")
    section = Section("run", "t", [], pictures=(Picture("run-view.html", "c"),))
    shown = report([section], {}, tmp_path)
    inside = re.search(r'<iframe title="c" sandbox="allow-scripts" srcdoc="([^"]*)"', shown)
    assert unescape(inside[1]) == text
    assert 'href="run-view.html"' in shown


def test_its_code_lies_in_files_of_its_own():
    for name in ("page.html", "page.js"):
        assert len((files("ribbonfem") / "output" / name).read_text(encoding="utf-8").splitlines()) <= 400


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
@pytest.mark.parametrize(
    ("width", "switches", "drawn"),
    [(1280, (), "webgl2"), (390, (), "webgl2"), (390, ("--disable-3d-apis",), "canvas")],
    ids=["wide", "phone", "without-gl"],
)
def test_a_browser_draws_it_and_hands_move_it(tmp_path, width, switches, drawn):
    path = view(motion(), tmp_path / "view.html", curve(), frames=9)
    with opened(path, tmp_path / "browser", width, 844, *switches) as shown:
        answer = shown.evaluate(HANDS)
    assert answer["drawn"] == drawn
    # the blank canvas, at first, turned by a key, dragged, at another instant
    assert answer["different"] == 5
    assert answer["marked"]
    assert answer["words"].startswith("U+S")
    assert (answer["going"], answer["stopped"]) == ("Pause", "Play")
    assert answer["wide"] <= answer["screen"] == width
    assert shown.asked == [path.as_uri()]
    assert shown.console == []
