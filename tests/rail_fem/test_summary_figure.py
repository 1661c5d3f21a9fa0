"""The summary of a sweep: what is published stands beside our numbers, and each case says how it differs."""

import numpy as np
from matplotlib.collections import LineCollection

from rail_fem.result.result import PassResult, Peak
from rail_fem.sweeps.group_figure import scene_facts, summary_figure, what_differs
from rail_fem.sweeps.sweep_page import OVER_LEG, PEAKS, SUMMARY, published_marks
from rail_fem.sweeps.trends import MEASURES, Published, Source
from tests.rail_fem.test_scene import make_scene
from tests.rail_fem.test_track_beam import bearers

SPEEDS = {"case_01": 44.704, "case_02": 33.528, "case_03": 33.528}  # 100, 75 and 75 mph


def result(model: str, speed: float, force: float) -> PassResult:
    scene = make_scene().model_copy(update={"speed": speed})
    peak = Peak(force, "N", 0.4, 0.0)
    peaks = {"first_impact_on_nose": peak, "largest_force": peak}
    return PassResult(model=model, scene=scene, settings={}, history={"time": [], "x": []}, peaks=peaks)


def sweep(forces: dict[str, float]) -> dict[str, dict[str, PassResult]]:
    return {
        case: {model: result(model, speed, force) for model, force in forces.items()} for case, speed in SPEEDS.items()
    }


def test_published_forces_are_dashes_at_their_cases_in_the_panels_of_forces():
    source = Source(group=(), published=(Published(case="case_02", dip=7.33, p2=175.28, peak=172.5),))
    marks = published_marks(source)
    assert set(marks) == set(PEAKS) and published_marks(Source(group=())) == {}
    panels = SUMMARY | OVER_LEG
    measures = {words: MEASURES[panels[words]] for words in (*PEAKS, "largest force\non the wing")}
    figure = summary_figure(sweep({"rigid_hertz": 150e3}), measures, "all", marks)
    lines = [[c for c in axes.collections if isinstance(c, LineCollection)] for axes in figure.axes]
    assert [len(found) for found in lines] == [1, 1, 1, 0]
    (segment,) = lines[0][0].get_segments()
    assert np.allclose(segment, [[0.55, 172.5], [1.45, 172.5]])


def test_a_bound_far_above_leaves_the_panel_with_its_value_written():
    """Else it would flatten the bars that are to be compared."""
    measures = {"largest force": MEASURES["largest force"]}
    (axes,) = summary_figure(sweep({"lumped": 900e3, "rigid_hertz": 200e3}), measures, "all").axes
    assert 200 < axes.get_ylim()[1] < 300
    assert [text.get_text() for text in axes.texts] == ["900"] * 3


def test_a_case_is_named_by_what_sets_it_apart():
    results = sweep({"rigid_hertz": 150e3})
    assert what_differs(results) == ["case_01: 100 mph", "case_02: the usual", "case_03: the usual"]
    two = dict(
        list(results.items())[:2]
    )  # as often the one as the other: the first counts, whatever the order of a set
    assert what_differs(two)[0] == "case_01: the usual"
    trailing = make_scene().model_copy(update={"direction": "trailing"})
    assert set(scene_facts(trailing)) - set(scene_facts(make_scene())) == {"trailing"}
    assert scene_facts(make_scene().replace(bearers=bearers()))[4] == "on bearers"  # whose foundation is not used
