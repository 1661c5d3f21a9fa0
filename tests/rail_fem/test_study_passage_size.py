"""The study of element sizes: orders and limits on what has exact ones, its page and figure, runs that are kept."""

from dataclasses import replace

import numpy as np
import pytest
from typer import BadParameter

from rail_fem.case.casefile import load_case
from rail_fem.case.examples import example
from rail_fem.result.error_bars import error_bars
from rail_fem.result.extrapolation import limit_of, observed_order
from rail_fem.result.quantities import REPORTED
from rail_fem.result.result import Cost
from rail_fem.settings.explicit import FeSettings
from rail_fem.studies import passage_size, size_series
from rail_fem.sweeps.rows import read_rows
from tests.rail_fem.test_error_bars import FORCE, MM, TRANSFER, at_size

CHOICES = example("rows/passage_choices")
SIZES = [4 * MM, 2 * MM, 1 * MM]


@pytest.mark.parametrize("order", [0.7, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("sizes", [SIZES, [3e-3, 2e-3, 1.5e-3], [5e-3, 3e-3, 0.5e-3]])
def test_the_observed_order_is_that_of_the_values_at_any_sizes(order, sizes):
    values = [7.0 - 3e4 * size**order for size in sizes]
    assert observed_order(sizes, values) == pytest.approx(order, rel=1e-8)


@pytest.mark.parametrize("values", [[1.0, 2.0, 1.5], [1.0, 1.0, 1.0], [1.0, 2.0], [1.0, 1.0 + 1e-9, 3.0]])
def test_values_that_approach_no_limit_have_no_order(values):
    """They turn back, do not change, are too few, or run away."""
    assert np.isnan(observed_order(SIZES[: len(values)], values))


def test_the_limit_of_second_order_values_is_exact():
    limit = limit_of(SIZES, [5.0 + 2e5 * size**2 for size in SIZES], 2.0)
    assert limit.value == pytest.approx(5.0, rel=1e-12) and limit.order == pytest.approx(2.0)
    assert limit.doubt == pytest.approx(2e5 * SIZES[-1] ** 2 / 2)


def test_values_that_scatter_widen_the_uncertainty():
    smooth = [5.0 + 2e5 * size**2 for size in SIZES]
    rough = [smooth[0], smooth[1] + 0.3, smooth[2]]
    assert limit_of(SIZES, rough, 2.0).doubt > limit_of(SIZES, smooth, 2.0).doubt


def test_bars_are_those_of_the_next_coarser_run_where_it_may_serve_as_twin():
    series = [at_size(size) for size in (6 * MM, *SIZES)]
    found = size_series.with_twins(series)
    assert not found[0].error_bars
    for finer, coarser in ((1, 0), (2, 1), (3, 2)):
        assert found[finer].error_bars == error_bars(series[finer], series[coarser])
    assert not size_series.with_twins([at_size(4 * MM), at_size(1 * MM)])[1].error_bars


@pytest.fixture(scope="module")
def series():
    whole = {"start": 0.29, "end": 0.43}
    return size_series.with_twins([replace(at_size(size), settings={"element_size": size, **whole}) for size in SIZES])


def test_the_page_tells_values_orders_and_limits(series):
    lines = passage_size.page(series).splitlines()
    first = next(line for line in lines if line.startswith("| first impact")).split(" | ")
    assert first[4] == "2.0" and first[5].startswith(f"{FORCE / 1e3:.1f} +- ")
    assert first[6] == "+32.0%, +8.0%, +2.0% |"
    transfer = next(line for line in lines if line.startswith("| transfer")).split(" | ")
    assert transfer[5].startswith(f"{TRANSFER * 1e3:.2f} +- ") and transfer[6] == "+4.00 mm, +1.00 mm, +0.25 mm |"
    assert not any(line.startswith("| volume with more than 3 %") for line in lines)  # nothing at any size


@pytest.mark.parametrize("text", ["", "2,two", "-1,2", "2,2", "0", "nan,2", "4;2"])
def test_sizes_that_cannot_be_read_are_refused_with_an_example(text):
    with pytest.raises(BadParameter, match="--sizes 4,2,1"):
        size_series.read_sizes(text)
    assert size_series.read_sizes("1, 4,2") == pytest.approx([4e-3, 2e-3, 1e-3])


def test_the_figure_has_the_errors_of_the_table_over_size_and_cost(series):
    """Second order: 32, 8 and 2 % of the limit."""
    dear = [replace(r, cost=Cost(wall_time=10.0 * 4**k)) for k, r in enumerate(series)]
    of_size, of_cost, impact, *_ = passage_size.panels(dear)
    for panel, x, name in (
        (of_size, [4, 2, 1], "_impact on the wheel"),
        (of_cost, [10, 40, 160], "impact on the wheel"),
    ):
        at, errors, _ = panel.lines[name]
        assert at == pytest.approx(x) and errors == pytest.approx([32, 8, 2], rel=0.01)
    sizes, (values, bars), _ = impact.lines["run, bar by its coarse twin"]
    assert sizes == pytest.approx([4, 2, 1]) and (impact.title, impact.ylabel) == ("impact on the wheel", "[kN]")
    assert bars == pytest.approx([1e-3 * r.error_bars.get("impact_on_wheel", 0.0) for r in dear])


def test_windows_of_the_whole_crossing_may_still_be_lengthened_for_larger_elements():
    """A list of choices asks for a window longer than any crossing on elements larger than the case's."""
    whole = read_rows(CHOICES).rows["whole crossing"]
    reference = passage_size.example("nose_transfer")
    longer = size_series._windows(reference, whole, 4 * MM)
    size = load_case(reference).settings(FeSettings).element_size
    assert load_case(reference, longer).settings(FeSettings).window_ahead == pytest.approx(4 + 6 * (4 * MM - size))


@pytest.mark.validate
def test_a_run_that_is_there_is_not_run_again_and_one_that_was_cut_goes_on(tmp_path):
    """On a few millimetres of the wing, elements of 6 mm."""
    said: list[str] = []
    short = {"run.fe_full.start": "95 mm", "run.fe_full.end": "125 mm", "run.fe_full.max_steps": 40}
    short |= {"run.fe_full.element_aspect": 1, "run.fe_full.wheel_element_ratio": 1}
    where = passage_size.example("nose_transfer")
    (cut,) = size_series.run_sizes(where, short, [6 * MM], tmp_path, said.append)
    assert cut.cut_off and (tmp_path / "6mm" / "checkpoint.npz").is_file()
    short["run.fe_full.max_steps"] = 80
    (more,) = size_series.run_sizes(where, short, [6 * MM], tmp_path, said.append)
    assert more.cost.steps == 80 and len(more.history["x"]) > len(cut.history["x"])
    written = (tmp_path / "6mm" / "result.json").stat().st_mtime_ns
    (again,) = size_series.run_sizes(where, short, [6 * MM], tmp_path, said.append)
    assert (tmp_path / "6mm" / "result.json").stat().st_mtime_ns == written
    assert REPORTED["transfer_x"].of(again) != REPORTED["transfer_x"].of(again)  # nothing is claimed of a cut run


def test_a_window_grows_with_the_elements_where_the_case_has_one(tmp_path):
    """By three elements of length at both ends; not for smaller elements, nor where it is automatic, nor in a case
    without this model."""
    keys = [f"run.fe_full.window_{end}" for end in ("ahead", "behind")]
    reference, given = passage_size.example("nose_transfer"), dict.fromkeys(keys, "60 mm")
    own = load_case(reference).settings(FeSettings)
    assert (own.window_ahead, own.window_behind, own.element_aspect) == ("auto", "auto", 2)
    grown = 60 + 6 * (4 - own.element_size / MM)
    assert size_series._windows(reference, given, 4 * MM) == dict.fromkeys(keys, f"{grown:.6g} mm")
    assert size_series._windows(reference, given, 0.5 * MM) == size_series._windows(reference, {}, 4 * MM) == {}
    light = tmp_path / "light.toml"
    light.write_text(reference.read_text().split("[run.fe_full]")[0] + "[run.lumped]\n")
    assert size_series._windows(light, {}, 4 * MM) == {}
