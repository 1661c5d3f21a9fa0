"""The page of a run, of several, of a sweep: its numbers are those of the report, it asks nobody for anything, and
what a stranger wrote stays text."""

import base64
import gzip
import json
import shutil
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from rail_fem import load_case, load_result, load_sweep, plot_sweep
from rail_fem.case.template import written
from rail_fem.files.markdown import markdown_table
from rail_fem.hierarchy import MODELS
from rail_fem.show.page import write_page
from rail_fem.show.page_charts import packed, thinned
from rail_fem.show.report import headlines
from rail_fem.sweeps.chooser import sweep_chart
from tests.browser import Browser, needs_chromium
from tests.commands import call
from tests.rail_fem.surrogate_run import surrogate_mesh, surrogate_strain, write_run
from tests.rail_fem.test_result import make_result
from tests.rail_fem.test_scene import make_scene
from tests.rail_fem.test_track_beam import bearers

pytest.importorskip("plotly")
LARGEST = 6e6  # bytes of a page
EVIL = "<script>alert(1)</script><img src=x onerror=alert(2)>"


class Page(HTMLParser):
    """The tags of a page with their attributes, its words outside scripts, and what its charts hold."""

    def __init__(self, path):
        super().__init__()
        self.tags, self.words, self.scripts, self.inside = [], "", {}, ""
        self.feed(path.read_text(encoding="utf-8"))
        pressed = base64.b64decode(self.scripts["charts"])
        self.charts = json.loads(gzip.decompress(pressed))

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.inside = (dict(attrs).get("id") or "own") if tag == "script" else "style" if tag == "style" else ""

    def handle_endtag(self, tag):
        self.inside = ""

    def handle_data(self, data):
        if self.inside:
            self.scripts[self.inside] = data
        else:
            self.words += data


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """An explicit run with fields, both bars and a title of a stranger."""
    folder = tmp_path_factory.mktemp("page") / "run"
    form = {"one mass in place of a casting on bearers": {"impact_on_wheel": -9e3}}
    bars = {"impact_on_wheel": 4e3}
    write_run(folder, title=EVIL, warnings=(EVIL,), form=form, error_bars=bars)
    return folder


@pytest.fixture(scope="module")
def page(run):
    return write_page([run], run / "page.html")


def test_a_page_is_one_file_that_asks_nobody_and_holds_the_numbers_of_the_report(run, page):
    read, result = Page(page), load_result(run)
    assert page.stat().st_size < LARGEST
    for _, attributes in read.tags:
        assert all(attributes.get(name, "data:").startswith("data:") for name in ("src", "href") if name in attributes)
    policy = next(one["content"] for tag, one in read.tags if one.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy and "http" not in policy
    told = headlines(result)
    assert any(one.elements == "4 kN" and one.form == "9 kN" for one in told)
    words = " ".join(read.words.split())
    for one in told:
        assert all(part in words for part in (one.value, one.elements, one.form, one.where))
    assert sum(tag == "img" and one.get("alt", "").startswith("run: plastic_strain") for tag, one in read.tags) == 2


def test_the_curves_of_a_page_are_the_history(run, page):
    charts, history = Page(page).charts, load_result(run).history
    force = charts[0][""]["data"][0]
    assert (force["x"], force["y"]) == (packed(1e3 * history["x"]), packed(history["force"] / 1e3))
    assert charts[1]["creep longitudinal [%]"]["data"][0]["y"] == packed(100 * history["creep_longitudinal"])


def test_every_picture_is_one_that_plotly_knows(page):
    from plotly.graph_objects import Figure

    pictures = [picture for chart in Page(page).charts for picture in chart.values()]
    assert [Figure(picture) for picture in pictures]  # refuses words that it does not know


def test_what_a_stranger_wrote_is_text(page):
    read = Page(page)
    assert sorted(one.get("id", "own") for tag, one in read.tags if tag == "script") == ["charts", "library", "own"]
    assert not any("onerror" in one for _, one in read.tags)
    assert read.words.count(EVIL) >= 3  # title, case, warning


def test_the_surface_that_turns_is_the_crossings_with_the_strain_of_its_elements(page):
    pictures = [chart[""] for chart in Page(page).charts if "" in chart]
    surface = next(one["data"][0] for one in pictures if one["data"][0]["type"] == "mesh3d")
    strain = np.frombuffer(base64.b64decode(surface["intensity"]["bdata"]), "<f4")
    corners = np.frombuffer(base64.b64decode(surface["i"]["bdata"]), f"<{surface['i']['dtype']}")
    assert len(strain) == len(corners) and surface["cmax"] == pytest.approx(strain.max(), rel=1e-6)
    assert strain.max() == pytest.approx(100 * surrogate_strain(surrogate_mesh()).max(), rel=1e-6)


def test_a_surface_of_too_many_faces_is_joined_and_keeps_its_largest_strain():
    """A plane of 60 x 40 faces: an eighth of them still covers it, to a grid's width."""
    x, y = np.meshgrid(np.arange(61.0), np.arange(41.0), indexing="ij")
    points, number = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), np.arange(x.size).reshape(x.shape)
    faces = np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)
    strain = np.arange(len(faces)) / len(faces)
    seen, joined, values, width = thinned(points, faces, strain, len(faces) // 8)
    assert len(joined) <= len(faces) // 8 and values.max() == strain.max()
    assert (np.ptp(seen, axis=0)[:2] > np.array([60.0, 40.0]) - 2 * width).all()  # a cell of the grid at each end
    assert thinned(points, faces, strain, len(faces))[3] == 0.0


@pytest.mark.parametrize("model", ["p2_formula", "rigid_hertz", "fe_full"])
def test_the_case_file_of_a_page_is_the_same_case_to_the_last_bit(tmp_path, model):
    scene = load_case("cases/nose_transfer.toml").scene.replace(
        speed="31.4159265358979 m/s", vehicle={"axle_load": "22.5 t"}, materials={"nose": {"strength": "110 %"}}
    )
    settings = MODELS[model].settings()
    (tmp_path / "case.toml").write_text(written('a "title"', scene, model, settings), encoding="utf-8")
    again = load_case(tmp_path / "case.toml")
    assert (again.scene.plain(), again.runs) == (scene.plain(), {model: settings})


def test_runs_beside_each_other_and_a_run_without_fields(run, tmp_path):
    other = tmp_path / "other"
    write_run(other, direction="trailing")
    shutil.rmtree(other / "fields")
    call("report", run, other, "--html", tmp_path / "both.html")
    read = Page(tmp_path / "both.html")
    assert "2 runs beside each other" in read.words and "no final.vtu" in read.words
    assert {"run: whole wheel", "other: whole wheel"} <= {trace.get("name") for trace in read.charts[0][""]["data"]}


def test_a_sweep_is_drawn_by_choice_as_its_figure_is(tmp_path):
    vary = ("--vary", "scene.speed=30mph:90mph:4", "--vary", "scene.foundation.stiffness=80 kN/mm,160 kN/mm")
    call("sweep", "cases/nose_transfer.toml", *vary, "--model", "p2_formula", "--out", tmp_path / "sweep")
    sweep = load_sweep(tmp_path / "sweep")
    figure = plot_sweep(sweep, "p2", "speed").axes[0]
    drawn = sweep_chart(sweep).pictures["p2 [kN]\nscene.speed [mph]"]["data"]
    lines = {line.get_label(): line.get_xydata() for line in figure.lines}
    assert len(drawn) == 2
    for trace in drawn:
        assert np.array_equal(np.column_stack([trace["x"], trace["y"]]), lines[trace["name"]])
    call("report", tmp_path / "sweep", "--html", tmp_path / "sweep.html")
    assert "8 runs" in Page(tmp_path / "sweep.html").words


def test_a_sweep_may_vary_a_list(tmp_path):
    """Bearers that hang: its page and its figure ended in a traceback, for a list is no place on an axis."""
    for voided in ((), (0, 1)):
        scene = make_scene().replace(bearers=bearers(voided=voided))
        replace(make_result(), scene=scene).save(tmp_path / f"case_{len(voided)}" / "rigid_hertz")
    sweep = load_sweep(tmp_path)
    drawn = sweep_chart(sweep).pictures["largest_force_nose [kN]\nscene.bearers.voided"]["data"]
    assert {x for trace in drawn for x in trace["x"]} == {"[]", "[0, 1]"}
    plot_sweep(sweep, "largest force nose", "voided")


def test_the_page_of_a_damage_study_or_a_design_holds_its_reports_and_figures(run, page, tmp_path):
    """Words of a stranger among them, and no library of curves. page : its figures are drawn by then"""
    rows = markdown_table(["body", "years"], [["nose", "3 | 4"], [EVIL, "9"]])
    lines = [
        f"# A life {EVIL}",
        "",
        "## nose",
        "",
        *rows,
        "",
        "[x](javascript:alert(1)) ![y](https://example.org/y.png)",
    ]
    (tmp_path / "report.md").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "proof.md").write_text("Proven by *fe_full*.\n", encoding="utf-8")
    (tmp_path / "figures").mkdir()
    shutil.copy(next((run / "figures").glob("*.png")), tmp_path / "figures" / "wear_depth.png")
    call("report", tmp_path, "--html", tmp_path / "life.html")
    read = Page(tmp_path / "life.html")
    tags = [tag for tag, _ in read.tags]
    assert tags.count("td") == 4 and tags.count("img") == 1 and tags.count("em") == 1 and "a" not in tags
    assert read.words.count(EVIL) >= 3 and "3 | 4" in read.words and "wear depth" in read.words
    assert not any("onerror" in one for _, one in read.tags) and not read.charts
    assert (tmp_path / "life.html").stat().st_size < 1e6


@needs_chromium
def test_a_browser_draws_the_page_and_a_choice_changes_the_curve(run, page):
    with Browser(page.as_uri()) as browser:
        browser.wait("document.body?.dataset.drawn")
        words = browser.value("document.body.innerText")
        assert all(one.value in words and one.elements in words for one in headlines(load_result(run)))
        lines = "[...document.querySelectorAll('.chart')[1].querySelectorAll('.js-line')].map(e => e.getAttribute('d'))"
        before = browser.value(lines)
        choose = (
            "(menu => { menu.selectedIndex = 1; menu.dispatchEvent(new Event('change')) })"
            "(document.querySelectorAll('.chart select')[0])"
        )
        browser.value(choose)
        assert before and before != browser.value(lines)
        assert browser.value("document.querySelectorAll('.turns canvas').length") > 0
        assert browser.value("document.getElementById('undrawn').hidden") and not browser.faults()
