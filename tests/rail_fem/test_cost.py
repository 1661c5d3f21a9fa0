"""The cost of a run in parts: compiling (once on a machine), searching (kept), and the model itself, which ranks."""

from types import SimpleNamespace

import numba
import pytest

import kernel_cache
from kernel_cache import compile_time, working_time
from rail_fem import load_result
from rail_fem.hierarchy import MODELS, solve
from rail_fem.models import lumped
from rail_fem.result.result import Cost
from rail_fem.show.report import result_report
from rail_fem.sweeps.compare import compare, core_seconds
from rail_fem.sweeps.compare_report import table

WINDOW = {"start": "300 mm", "end": "400 mm"}


def compile_something() -> None:
    """A kernel that no cache holds."""

    @numba.njit(cache=False)
    def total(n):
        found = 0.0
        for i in range(n):
            found += i**0.5
        return found

    assert total(3) > 2


def test_the_clock_of_the_models_stands_still_while_kernels_are_compiled(monkeypatch):
    """While the wall's clock is held, the models' runs back by what the compiler says that it took."""
    monkeypatch.setattr(kernel_cache, "time", SimpleNamespace(perf_counter=lambda: 100.0))
    working, before = working_time(), compile_time()
    compile_something()
    assert working - working_time() == pytest.approx(compile_time() - before, rel=1e-9) and compile_time() > before


def test_the_parts_make_up_the_whole():
    cost = Cost(wall_time=10.0, search_time=3.0, compile_time=5.0)
    assert cost.solve_time == 2.0 and Cost(wall_time=4.0).solve_time == 4.0


def test_a_first_run_is_ranked_by_its_solution_not_by_what_it_compiles(scene, tmp_path, monkeypatch):
    """A model whose run compiles something is the same model afterwards: only compile_time tells them apart."""
    within = lumped.solve

    def compiling(*arguments, **options):
        compile_something()
        return within(*arguments, **options)

    again = solve("lumped", scene, WINDOW)
    monkeypatch.setattr(lumped, "solve", compiling)
    before = compile_time()
    first = solve("lumped", scene, WINDOW)
    assert first.cost.compile_time == compile_time() - before > 0
    for result in (first, again):
        cost = result.cost
        assert cost.search_time > 0 and cost.solve_time > 0
        assert cost.solve_time + cost.search_time + cost.compile_time == pytest.approx(cost.wall_time, rel=1e-12)
        assert core_seconds(result) == cost.solve_time
    assert again.cost.search_time == first.cost.search_time  # kept, and counted in both
    first.save(tmp_path / "first")
    again.save(tmp_path / "again")
    kept = load_result(tmp_path / "first")
    assert repr(kept.cost) == repr(first.cost) and "kernels compiled" in result_report(kept)
    found = compare([tmp_path])
    assert sorted(map(core_seconds, found.results)) == [*map(core_seconds, found.results)]
    assert "search, compilation [s]" in table(found)


@pytest.mark.parametrize("model", [name for name, model in MODELS.items() if name in ("p2_formula", "rigid_hertz")])
def test_every_light_model_tells_its_search_apart(scene, model):
    result = solve(model, scene, WINDOW if model == "rigid_hertz" else None)
    assert 0 < result.cost.search_time < result.cost.wall_time
