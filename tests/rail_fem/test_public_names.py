"""What a user of the package writes: five lines from a case file to a figure, every mistake said."""

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import bem
import geometry
import rail_fem
from rail_fem.case.warnings import case_warnings
from rail_fem.result.history import COLUMNS
from rail_fem.result.warning_records import record
from rail_fem.scene.units import root_units, si_factor
from rail_fem.settings.explicit import FeSettings

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "nose_transfer.toml"
WINDOW = {"start": "250 mm", "end": "420 mm"}


@pytest.fixture(scope="module")
def result():
    return rail_fem.solve("lumped", rail_fem.load_case(CASE).scene, WINDOW)


@pytest.mark.parametrize("package", [rail_fem, geometry, bem])
def test_every_public_name_is_there_and_a_wrong_one_says_what_is(package):
    assert all(callable(getattr(package, name)) or name.isupper() for name in package.__all__)
    with pytest.raises(AttributeError, match=f"nothing.*it offers.*{package.__all__[1]}"):
        package.nothing  # noqa: B018


def test_the_parts_are_the_same_modules_by_the_names_of_an_installed_package():
    """A wheel has them beneath rail_fem alone."""
    code = (
        "import rail_fem.geometry.profiles.wheel as deep; import geometry, bem, geometry.profiles.wheel as own; "
        "from rail_fem.bem import STEEL; assert rail_fem.geometry is geometry and rail_fem.bem is bem and deep is own "
        "and STEEL is bem.STEEL and own.__spec__.name == own.__name__ == 'geometry.profiles.wheel'"
    )
    subprocess.run([sys.executable, "-c", f"import rail_fem; {code}"], cwd=ROOT, check=True)


def functions_of(package):
    """Name and function of every public function and method."""
    for name in package.__all__:
        found = getattr(package, name)
        if inspect.isfunction(found):
            yield name, found
        elif inspect.isclass(found):
            yield from (
                (f"{name}.{own}", getattr(method, "__func__", method))
                for own, method in vars(found).items()
                if not own.startswith("_") and inspect.isfunction(getattr(method, "__func__", method))
            )


@pytest.mark.parametrize("package", [rail_fem, geometry, bem])
def test_files_and_folders_may_be_text_in_every_public_function(package):
    """What runs with a string has to be right for a type checker, too."""
    narrow = [
        f"{name}({argument}: {kind})"
        for name, function in functions_of(package)
        for argument, kind in inspect.get_annotations(function).items()
        if argument != "return" and re.search(r"\bPath\b", str(kind)) and "str" not in str(kind)
    ]
    assert not narrow


CALLABLE = [
    (package.__name__, name)
    for package in (rail_fem, geometry, bem)
    for name in package.__all__
    if name.upper() != name
]
SECTION = re.compile(r"^(Parameters|Attributes|Returns|Raises|Notes|Examples)\n-+\n", re.MULTILINE)


def sections(thing) -> dict[str, str]:
    """A docstring's sections in NumPy's form."""
    parts = SECTION.split(inspect.getdoc(thing) or "")
    return dict(zip(parts[1::2], parts[2::2]))


@pytest.mark.parametrize("package, name", CALLABLE)
def test_a_public_docstring_names_every_parameter_and_what_comes_out(package, name):
    """In NumPy's form, so that a notebook's help and the page of the interface show them one by one."""
    thing = getattr(sys.modules[package], name)
    found = sections(thing)
    signature = inspect.signature(thing.__init__ if thing is geometry.ProfileError else thing)  # of ValueError's own
    heads = re.findall(r"^(?! )([\w*, ]+?)(?: :|$)", found.get("Parameters", found.get("Attributes", "")), re.MULTILINE)
    named = {one.strip().lstrip("*") for line in heads for one in line.split(",")}
    assert set(signature.parameters) - {"self", "args", "kwargs"} <= named
    assert "Examples" in found
    returns = inspect.isfunction(thing) and signature.return_annotation not in (None, "None")
    assert not returns or found.get("Returns", "").strip()


@pytest.mark.parametrize("package, name", CALLABLE)
def test_the_example_of_a_public_name_runs(package, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    known = {"np": np, "rail_fem": rail_fem, "geometry": geometry, "bem": bem}
    finder = doctest.DocTestFinder(recurse=False)
    (example,) = finder.find(getattr(sys.modules[package], name), name, module=False, globs=known)
    said: list[str] = []
    assert doctest.DocTestRunner().run(example, out=said.append).failed == 0, "".join(said)


def test_a_former_name_is_taken_for_one_release_with_a_warning():
    """And the wheel comes before the crossing."""
    with pytest.warns(DeprecationWarning, match="force is load now"):
        old = bem.point_contact(force=1e5, radius_x=0.46, radius_y=0.3, modulus=115e9)
    assert old == bem.point_contact(1e5, 0.46, 0.3, 115e9)
    with pytest.raises(TypeError, match="force is the former name of load"):
        bem.line_contact(force=1.0, load=1.0, radius=0.3, modulus=115e9)
    wheel, crossing, x = geometry.wheel_profile("P8"), geometry.CastCrossing(), np.array([0.3])
    with pytest.warns(DeprecationWarning, match="wheel before the crossing"):
        former = geometry.wheel_path(crossing, wheel, x)
    assert former.height == geometry.wheel_path(wheel, crossing, x).height


def test_what_goes_on_is_logged_and_nothing_is_printed(result, caplog, capsys):
    with caplog.at_level("INFO", logger="rail_fem"):
        found = rail_fem.solve("lumped", result.scene, WINDOW)
    said = [(one.levelname, one.getMessage()) for one in caplog.records if one.name == "rail_fem.hierarchy"]
    assert said[0] == ("INFO", "lumped: begun") and "finished in" in said[1][1]
    assert [words for level, words in said if level == "WARNING"] == [f"lumped: {one}" for one in found.warnings] != []
    assert capsys.readouterr() == ("", "")


def test_warnings_are_records_with_kind_and_place(result):
    """Of results of earlier releases too, which hold sentences alone."""
    records = result.warning_records
    assert tuple(one.text for one in records) == result.warnings
    scene = result.scene.replace(wheel={"profile": "P1"}, crossing={"ratio": 14}, friction=0.8)
    told = [
        *case_warnings(scene, FeSettings.checked({"start": "0 mm", "end": "340 mm", "courant": 0.96})),
        *result.warnings,
    ]
    kinds = {record(words).kind for words in told}
    assert kinds == {"scene", "numerics", "window", "model"} and len(told) > 6
    assert record("chatter: 3 % of it (rule: < 1 %, bad above 5 %)").kind == "trust"
    two = next(one for one in records if one.text.startswith("two bodies"))
    assert two.kind == "model" and 0.25 < two.x < 0.42  # within the window


@pytest.mark.parametrize("package", [rail_fem, geometry, bem])
def test_the_example_of_a_package_runs(package, tmp_path, monkeypatch):
    """The indented block of its docstring."""
    monkeypatch.chdir(tmp_path)
    points = geometry.wheel_profile("P8").points * 1e3
    np.savetxt("wheel.csv", points, delimiter=",")
    lines = [line[4:] for line in package.__doc__.splitlines() if line.startswith("    ")]
    names: dict = {}
    exec("\n".join(lines).replace('"wheel.whl"', '"wheel.csv", kind="wheel"'), names)
    assert len(names) > 3


def test_the_import_is_light():
    """Neither numerics nor dolfinx, MPI, Gmsh, VTK or matplotlib come with the bare import."""
    code = (
        "import sys, rail_fem, geometry, bem; print(*{'numpy', 'numba', 'dolfinx', 'mpi4py', 'gmsh', 'vtk',"
        " 'matplotlib', 'pydantic'} & set(sys.modules))"
    )
    answer = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert answer.stdout.split() == []


def test_examples_come_along():
    assert rail_fem.load_case(rail_fem.example("nose_transfer")).scene == rail_fem.load_case(CASE).scene
    assert rail_fem.load_case("nose_transfer").path == rail_fem.example("nose_transfer")
    with pytest.raises(rail_fem.CaseError, match="'rail-fem list' names the examples"):
        rail_fem.load_case("nose_transfr")
    with pytest.raises(KeyError, match="nose_transfer"):
        rail_fem.example("nose_transfr")


def test_a_scene_is_changed_as_a_case_file_is_read():
    scene = rail_fem.load_case(CASE).scene
    faster = scene.replace(
        speed="100 mph", foundation={"stiffness": "160 kN/mm"}, materials={"nose": {"strength": "150 %"}}
    )
    assert faster.speed == pytest.approx(44.704) and scene.speed == pytest.approx(33.528)
    assert faster.foundation.stiffness == pytest.approx(160e6) and faster.foundation.damping == scene.foundation.damping
    assert faster.materials.nose.strength == 1.5 and faster.materials.wing == scene.materials.wing
    for wrong in ({"speed": "600 mph"}, {"sped": 20.0}, {"speed": "10 kN"}, {"foundation": {"stiffness": "-1 kN/mm"}}):
        with pytest.raises(ValueError, match="speed|sped|stiffness"):
            scene.replace(**wrong)


def test_a_bare_number_is_refused_where_a_case_file_refuses_it():
    """75 mph or 75 m/s? Numbers that are computed in SI have a name of their own."""
    scene = rail_fem.load_case(CASE).scene
    for wrong, key in (
        ({"speed": 75}, "speed"),
        ({"speed": np.float64(33.5)}, "speed"),
        ({"foundation": {"stiffness": 1.6e8}}, "foundation.stiffness"),
        ({"bearers": {"spacing": 0.6}}, "bearers.spacing"),
        ({"materials": {"wing": {"grade": "Mn13", "hardening_stress": [3e8, 4e8]}}}, "materials.wing.hardening_stress"),
    ):
        with pytest.raises(ValueError, match=f"{key}: .* has no unit, write e.g. .*, or replace_si takes SI"):
            scene.replace(**wrong)
    with pytest.raises(ValueError, match="start: 0.3 has no unit, write e.g. .*, or LumpedSettings.checked takes SI"):
        rail_fem.solve("lumped", scene, {"start": 0.3})
    assert scene.replace_si(speed=33.5, foundation={"stiffness": 1.6e8}).speed == 33.5
    assert scene.replace(friction=0.2, wheel_body=None).friction == 0.2  # a plain number has no unit


def test_a_measured_wheel_stays_as_it_was_read(tmp_path):
    """A change beside the profile does not read the file again, which may be gone by then; another profile does."""
    scene = rail_fem.load_case(CASE).scene
    points = scene.wheel.shape.points * 1e3
    file = tmp_path / "wheel.csv"
    np.savetxt(file, points, delimiter=",")
    measured = scene.replace(wheel={"profile": str(file)})
    file.unlink()
    smaller = measured.replace(wheel={"radius": "400 mm"})
    assert smaller.wheel.digest == measured.wheel.digest != "" and smaller.wheel.radius == 0.4
    assert smaller.replace(wheel={"profile": "P8"}).wheel.digest == ""
    with pytest.raises(ValueError, match="no file"):
        measured.replace(wheel={"profile": str(tmp_path / "other.csv")})


def test_a_result_is_short_in_a_terminal_and_a_table_in_a_notebook(result):
    assert len(repr(result)) < 300 and "lumped" in repr(result) and "kN at x" in repr(result)
    assert result._repr_html_().count("<tr>") == len(result.summary_rows())


def test_a_history_becomes_a_data_frame(result):
    pandas = pytest.importorskip("pandas")
    shown, plain = result.to_dataframe(), result.to_dataframe(si=True)
    assert isinstance(shown, pandas.DataFrame) and len(shown) == len(result.history["x"])
    assert np.allclose(shown["force [kN]"] * 1e3, plain["force"], rtol=1e-12, equal_nan=True)


def test_a_history_becomes_a_data_set_in_si_with_its_units(result):
    pytest.importorskip("xarray")
    found = result.to_xarray()
    assert found["force"].dims == ("time",) and np.array_equal(found["x"], result.history["x"])
    assert found["force"].attrs["units"] == "N" and found["wheel_height"].attrs["units"] == "m"
    for name, column in COLUMNS.items():  # SI, and of the dimension that tables show
        unit = found[name].attrs["units"].removeprefix("1")  # a plain number
        assert si_factor(unit) == pytest.approx(1.0) and root_units(unit)[1] == root_units(column.unit)[1]
        assert found[name].attrs["long_name"] == column.meaning
    largest = found["largest_force"]
    assert float(largest) == result.peaks["largest_force"].value and largest.attrs["units"] == "N"
    assert largest.attrs["x"] == result.peaks["largest_force"].x


def test_the_force_is_drawn(result, tmp_path):
    rail_fem.plot_force(result, "a title").savefig(tmp_path / "force.png")
    assert (tmp_path / "force.png").stat().st_size > 5000
    own = Figure().subplots()
    assert rail_fem.plot_force(result, ax=own) is own and own.get_ylabel() == "vertical force [kN]"
    assert np.array_equal(own.lines[0].get_ydata(), result.history["force"] / 1e3)


def test_settings_that_are_none_are_refused():
    with pytest.raises(ValueError, match="strat"):
        rail_fem.solve("lumped", rail_fem.load_case(CASE).scene, {"strat": "200 mm"})


def test_a_wrong_model_scene_or_kind_of_settings_is_told_in_a_sentence():
    case = rail_fem.load_case(CASE)
    with pytest.raises(
        KeyError, match="no model 'rigid_herz', did you mean 'rigid_hertz'\\?: choose among p2_formula, .*rigid_hertz"
    ):
        rail_fem.solve("rigid_herz", case.scene)
    for none in (case, str(CASE), None):
        with pytest.raises(TypeError, match="is no Scene: give load_case.FILE..scene"):
            rail_fem.solve("p2_formula", none)
    with pytest.raises(TypeError, match="p2_formula takes P2Settings, not FeSettings"):
        rail_fem.solve("p2_formula", case.scene, case.runs["fe_full"])


def test_a_sweep_folder_is_read_at_once(result, tmp_path):
    for speed in ("50 mph", "75 mph"):
        scene = result.scene.replace(speed=speed)
        rail_fem.solve("lumped", scene, WINDOW).save(tmp_path / speed.replace(" ", "_") / "lumped")
    sweep = rail_fem.load_sweep(tmp_path)
    assert list(sweep) == ["50_mph", "75_mph"] and "2 runs" in repr(sweep)
    assert sweep["75_mph"]["lumped"].peaks["largest_force"].value == result.peaks["largest_force"].value
    with pytest.raises(KeyError, match="75_mph"):
        sweep["60_mph"]
    pytest.importorskip("pandas")
    assert list(sweep.to_dataframe()["case"]) == ["50_mph", "75_mph"]
    pytest.importorskip("xarray")
    forces = sweep.to_xarray()["largest_force"]
    assert forces.dims == ("scene.speed", "model") and forces.attrs["units"] == "kN"
    assert float(forces.sel({"scene.speed": 75, "model": "lumped"})) * 1e3 == pytest.approx(
        result.peaks["largest_force"].value, rel=1e-12
    )
    with pytest.raises(FileNotFoundError):
        rail_fem.load_sweep(tmp_path / "nothing")


def test_a_key_of_the_crossing_varies_from_the_benchmarks_own_value_on(result, tmp_path):
    """Which the mark of a run leaves out."""
    for raised in (1, 0):
        scene = result.scene.replace(crossing={"wing_raise": f"{raised} mm"})
        rail_fem.solve("p2_formula", scene).save(tmp_path / f"raised_{raised}" / "p2_formula")
    sweep = rail_fem.load_sweep(tmp_path)
    assert sweep.varied == ["scene.crossing.wing_raise"]
    assert [row["scene.crossing.wing_raise [mm]"] for row in sweep.rows()] == [0.0, 1.0]


@pytest.mark.parametrize("package", [rail_fem, geometry, bem], ids=lambda package: package.__name__)
def test_every_public_name_stands_on_the_page_of_the_interface(package):
    """docs/api.md lists the members of each package as a whole; what is no class and no function it names."""
    page = (Path(__file__).resolve().parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
    assert f".. automodule:: {package.__name__}\n   :members:\n   :imported-members:" in page
    for name in package.__all__:
        public = getattr(package, name)
        assert public.__doc__ if callable(public) else f".{name}\n" in page, name
