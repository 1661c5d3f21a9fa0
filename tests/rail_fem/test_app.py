"""The app: its sliders are the case file's keys, its numbers those of a run by the command line, and nobody but its own
page is answered."""

import http.client
import json
import shutil
import threading
import time

import pytest

from rail_fem import load_case, load_result, solve
from rail_fem.app import server as app_server
from rail_fem.app.controls import changed, controls
from rail_fem.case.casefile import CaseError
from rail_fem.scene.scene import Scene
from rail_fem.show.page_charts import packed
from rail_fem.show.report import headlines
from tests.browser import Browser, needs_chromium
from tests.commands import call

pytest.importorskip("plotly")
EVIL = "</title><script>document.title='taken'</script>"


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """The reference pass with a stranger's title."""
    path = tmp_path_factory.mktemp("app") / "case.toml"
    text = open("cases/nose_transfer.toml", encoding="utf-8").read()
    path.write_text(text.replace('title = "UK', f'title = "{EVIL} UK'), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def server(case):
    server = app_server.Server(app_server.App(case, case.parent / "runs", 1))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()
    server.app.close()


def ask(server, path, body=None, host=None, method=None):
    """Status, headers and body of an answer."""
    line = http.client.HTTPConnection(app_server.HERE, server.server_port, timeout=300)
    line.putrequest(method or ("GET" if body is None else "POST"), path, skip_host=True)
    line.putheader("Host", f"{app_server.HERE}:{server.server_port}" if host is None else host)
    data = b"" if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    line.putheader("Content-Length", str(len(data)))
    line.endheaders(data)
    answer = line.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    line.close()
    return found


def moved(server, values):
    status, _, body = ask(server, f"/{server.token}/pass", values)
    assert status == 200
    return json.loads(body)


def test_nobody_without_the_token_or_by_another_name_is_answered(server):
    """Also what rests on a name that a stranger has bound to this machine, and paths beside what there is."""
    assert server.server_address[0] == "127.0.0.1" and len(server.token) >= 32
    for path in (
        "/",
        "/pass",
        "/wrong/",
        f"/{server.token}",
        f"/{server.token[:-1]}/",
        f"/{server.token}x/",
        "//",
        "*",
    ):
        for body in (None, {}):
            status, headers, words = ask(server, path, body)
            assert status == 403 and server.token.encode() not in words + str(headers).encode()
    port = server.server_port
    for host in ("", "evil.example", f"evil.example:{port}", f"127.0.0.1.evil.example:{port}", "127.0.0.1"):
        assert ask(server, f"/{server.token}/", host=host)[0] == 403
    assert ask(server, f"/{server.token}/", host=f"localhost:{port}")[0] == 200
    for name in (
        "../case.toml",
        "%2e%2e/case.toml",
        "/etc/passwd",
        "page/../../case.toml",
        "app.js",
        "page",
        "case.toml",
    ):
        assert ask(server, f"/{server.token}/{name}")[0] == 404
    assert ask(server, f"/{server.token}/", method="OPTIONS")[0] == 501


def test_the_page_is_its_own_and_a_title_stays_text(server):
    _, headers, body = ask(server, f"/{server.token}/")
    page = body.decode()
    assert headers["Cache-Control"] == "no-store" and headers["X-Frame-Options"] == "DENY"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert EVIL not in page and "default-src 'none'" in page and "http:" not in page.partition("</title>")[0]


def test_the_sliders_are_keys_of_the_case_with_their_units_and_ranges(case):
    found = {one.key: one for one in controls(load_case(case))}
    quantity = next(part for part in Scene.model_fields["speed"].metadata if hasattr(part, "unit"))
    speed = found["scene.speed"]
    assert (speed.unit, *speed.span, float(speed.value)) == (quantity.unit, quantity.low, quantity.high, 75.0)
    assert all(
        one.span[0] <= one.low <= float(one.value) <= one.high <= one.span[1] for one in found.values() if one.step
    )
    assert float(found["scene.vehicle.axle_load"].value) == 66.25 / 4 + 1  # four axles, each with its wheelset
    assert "P8" in found["scene.wheel.profile"].choices


def test_a_crossing_of_another_family_has_no_slider_that_it_refuses(tmp_path):
    text = open("cases/nose_transfer.toml", encoding="utf-8").read()
    path = tmp_path / "joint.toml"
    path.write_text(
        text.replace('family = "UK-cast"\nratio = 10.75', 'family = "joint"').partition("[run.")[0] + "[run.lumped]\n"
    )
    known = [one.key for one in controls(load_case(path))]
    assert "scene.speed" in known and not any(key.startswith("scene.crossing") for key in known)


def test_what_is_seen_is_the_pass_of_that_scene_and_its_case_file_gives_it_again(server, tmp_path):
    values = {"scene.speed": "60 mph", "scene.crossing.wing_raise": "1 mm", "scene.vehicle.axle_load": "20 t"}
    found = moved(server, values)
    (tmp_path / "again.toml").write_text(found["case"], encoding="utf-8")
    again = load_case(tmp_path / "again.toml")
    assert again.scene.plain() == changed(server.app.case, values).scene.plain()
    history = solve("rigid_hertz", again.scene, again.runs["rigid_hertz"]).history
    force = found["charts"][0][""]["data"][0]
    assert (force["x"], force["y"]) == (packed(1e3 * history["x"]), packed(history["force"] / 1e3))
    call("run", tmp_path / "again.toml", "--out", tmp_path / "run")
    impact = next(one for one in headlines(load_result(tmp_path / "run")) if one.name == "impact_on_wheel")
    assert impact.value in found["told"] and "bar of form" in found["told"]
    assert "60 mph" in found["title"] and "wheel load 98.1 kN" in found["title"]  # of 20 t, half
    assert found["command"].startswith("rail-fem run ") and "'scene.speed=60 mph'" in found["command"]


@pytest.mark.parametrize(
    "values, words",
    [
        ({"scene.speed": "900 mph"}, "[0.5, 350] mph"),
        ({"scene.speed": "60"}, "no unit"),
        ({"scene.speed": ["60 mph"]}, "not a quantity"),
        ({"scene.wheel.profile": "/etc/passwd"}, "none of"),
        ({"scene.wheel.profile": "../P8.csv"}, "none of"),
        ({"scene.crossing.file": "/etc/passwd"}, "is not moved here"),
        ({"run.fe_full.element_size": "1 mm"}, "is not moved here"),
        ([1], "no table of keys"),
    ],
)
def test_bad_values_are_refused_in_the_words_of_the_case_file(server, values, words):
    assert words in " ".join(moved(server, values)["errors"])


@pytest.mark.parametrize("body", [b"", b"{", b"\xff", b"[" * 50_000, b'{"model": "x"}', b"{}" + b" " * 70_000])
def test_what_is_no_request_is_refused_and_the_next_one_answered(server, body):
    assert json.loads(ask(server, f"/{server.token}/start", body)[2])["errors"]
    assert json.loads(ask(server, f"/{server.token}/progress", {})[2])["words"] == ""


def test_a_file_of_a_profile_is_not_to_be_named_from_outside(case):
    with pytest.raises(CaseError, match="none of"):
        changed(load_case(case), {"scene.wheel.profile": str(case)})


def test_a_wheel_that_creeps_is_drawn_as_soon_as_a_fast_one(server):
    """At 0.5 mph a pass takes 2.7 s: rows are farther apart, and the case file says so."""
    found = moved(server, {"scene.speed": "0.5 mph"})
    assert len(json.dumps(found)) < 1e6 and "history_interval" in found["case"]


def test_a_run_is_started_as_a_sweep_would_and_its_page_is_shown(case, tmp_path):
    """p2_formula in place of fe_full: the same way, in a process of its own."""
    app = app_server.App(case, tmp_path / "runs", 1)
    try:
        asked = {"model": "p2_formula", "values": {"scene.speed": "60 mph"}}
        app.start(asked)
        while (told := app.progress())["running"]:
            with pytest.raises(ValueError, match="one run at a time"):
                app.start(asked)
            time.sleep(0.2)
        assert told["page"] and "finished" in told["words"]
        result = load_result(tmp_path / "runs" / "case-speed=60mph" / "p2_formula")
        assert result.scene.speed == pytest.approx(60 * 0.44704)
        assert b"p2_formula" in app.page_of_run()
    finally:
        app.close()


def test_a_run_that_was_killed_or_removed_keeps_nobody_from_the_next(case, tmp_path):
    app = app_server.App(case, tmp_path / "runs", 1)
    with app_server.Server(app) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        app.start({"model": "p2_formula", "values": {}})
        for worker in app._workers._processes.values():
            worker.kill()
        while (told := app.progress())["running"]:
            time.sleep(0.05)
        assert "FAILED: BrokenProcessPool" in told["words"]
        begun = json.loads(ask(server, f"/{server.token}/start", {"model": "p2_formula", "values": {}})[2])
        while begun["running"]:
            time.sleep(0.05)
            begun = app.progress()
        assert begun["page"]
        shutil.rmtree(tmp_path / "runs")
        status, _, words = ask(server, f"/{server.token}/page")
        assert status == 500 and b"no result.json there" in words
        server.shutdown()
        app.close()


@needs_chromium
def test_a_slider_changes_curve_numbers_and_case_file_in_a_browser(server):
    with Browser(server.address) as browser:
        browser.wait("document.body?.dataset.drawn && document.body.dataset.took")
        line = "document.querySelector('.chart .js-line').getAttribute('d')"
        before = browser.value(line), browser.value("document.getElementById('told').innerText")
        assert "scene.speed=" not in browser.value("document.getElementById('command').innerText")
        browser.value(
            "(slider => { slider.value = 60; slider.dispatchEvent(new Event('input', {bubbles: true})) })"
            "(document.querySelector('[data-key=\"scene.speed\"]').closest('label').querySelector('[type=range]'))"
        )
        browser.wait("document.getElementById('case').innerText.includes('60 mph')")
        assert browser.value(line) != before[0]
        assert browser.value("document.getElementById('told').innerText") != before[1]
        assert browser.value("document.getElementById('save').href").startswith("data:text/plain")
        assert "60 mph" in browser.value("document.title") == browser.value("document.querySelector('h1').innerText")
        assert not browser.faults()


def test_a_case_that_cannot_be_read_starts_nothing(tmp_path):
    (tmp_path / "bad.toml").write_text("[scene]\n")
    assert "input error" in call("app", tmp_path / "bad.toml", code=2).output
