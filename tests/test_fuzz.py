"""Whatever is typed at a command line, or given to a public function in its own types, ends in an answer or in a
sentence: never in an exception that is not the project's own.

Options, arguments and parameters are those of the program itself, so that a new one is tried as well. Left out:
`doctor`, which takes none and starts processes; `app`, which does not end; studies by their names; cases that compute
for longer than a second.
"""

import inspect
import math
import os
import sys
import types
import typing
from pathlib import Path

import numpy as np
import pytest
import typer
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import bem
import geometry
import rail_fem
from rail_fem.cli import app

COMMANDS = {name: one for name, one in typer.main.get_command(app).commands.items() if name not in ("doctor", "app")}
FILES = ["case.toml", "broken.toml", "run", "sweep", "empty", "binary", "profile.csv", "record.csv", "own.msh", "pipe",
         "utf16.csv", "nowhere/x", ".", "long" * 80, "a\nb", "\udcff"]  # fmt: skip
WORDS = ["", " ", "-1", "0", "16", "1e400", "nan", "-inf mm", "9" * 30, "80 kN", "5 mm", "-6 mm:6 mm:3", "1:2:9e9",
         "1 mm:2 mm:0", "1 furlong", "P8", "60E1", "p2_formula", "fe_full", "lumped", "rigid_hertz", "scene.speed",
         "scene.speed=60 mph", "scene.speed=", "=", "scene=3", "run.p2_formula.dip_angle=[[1]]", "scene.speed=1,2",
         "scene.vehicle.wheel_load=[[[[1]]]]", "rail", "wheel", "crown", "1,2", "all", "largest force", "20 Hz",
         "x.png", "x.exe", "x.csv", "x.vtu", "x.step", "new"]  # fmt: skip
TEXTS = [word for word in WORDS if word not in ("fe_full", "lumped", "rigid_hertz")]  # models that compute for long
FITTING = {"case": "case.toml", "cases": "case.toml", "folder": "run", "folders": "sweep", "file": "profile.csv",
           "record": "record.csv", "wheel": "P8", "rail": "60E1", "load": "80 kN", "out": "new", "to": "x.step",
           "model": "p2_formula", "models": "p2_formula", "cells": "16"}  # fmt: skip
NUMBERS = st.one_of(
    st.sampled_from([0.0, -0.0, 1e-300, -1.0, 0.3, 1.0, 50.0, 1e3, 1e300, math.inf, -math.inf, math.nan]),
    st.floats(0.01, 2.0),
)
WHOLE = st.sampled_from([-1, 0, 1, 2, 3, 16])
ARRAYS = st.sampled_from(
    [np.empty(0), np.zeros((0, 2)), np.zeros(3), np.full((4, 2), np.nan), np.arange(6.0), np.arange(12.0).reshape(6, 2)]
)
FUZZ = settings(
    deadline=None, phases=[Phase.generate], derandomize=True, database=None, suppress_health_check=list(HealthCheck)
)


@pytest.fixture(autouse=True)
def scratch(tmp_path, monkeypatch):
    """The current folder, with what the FILES are."""
    monkeypatch.chdir(tmp_path)
    text = rail_fem.example("nose_transfer").read_text().partition("[run.")[0]
    Path("case.toml").write_text(text + '[run.p2_formula]\ndip_angle = "15 mrad"\n')
    Path("broken.toml").write_text(text.replace("speed", "sped") + "[run.x]\n")
    result = rail_fem.solve("p2_formula", rail_fem.load_case("case.toml").scene, {"dip_angle": "10 mrad"})
    for name in ("run", "sweep/case/p2_formula"):
        result.save(Path(name))
    Path("empty").write_bytes(b"")
    Path("binary").write_bytes(bytes(range(256)))
    np.savetxt("profile.csv", geometry.wheel_profile("P8").points[::4] * 1e3)
    rows = "".join(f"{k},{k % 7}\n" for k in range(40))
    Path("record.csv").write_text(f"time [ms], force [kN]\n{rows}")
    Path("own.msh").write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n")
    Path("utf16.csv").write_bytes(b"\xff\xfe1")
    os.mkfifo("pipe")


@st.composite
def lines(draw, name: str) -> list[str]:
    """A command with some of its options and about as many arguments as it takes."""
    words = [name]
    for one in COMMANDS[name].params:
        argument = one.param_type_name == "argument"
        if not draw(st.booleans() if not (argument or one.required) else st.sampled_from([True] * 9 + [False])):
            continue
        words += [] if argument else [one.opts[0]]
        if argument or not one.is_flag:
            fitting = FITTING.get(one.name)
            odd = st.sampled_from(WORDS + FILES)
            words.append(draw(st.one_of(st.just(fitting), st.just(fitting), odd) if fitting else odd))
    return words


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_line_ends_in_an_answer_or_a_sentence(name):
    @settings(FUZZ, max_examples=10)
    @given(lines(name))
    def tried(words):
        answer = CliRunner().invoke(app, words)
        assert answer.exception is None or isinstance(answer.exception, SystemExit), (words, repr(answer.exception))
        assert answer.exit_code in (0, 1, 2) and "Traceback" not in answer.output, (words, answer.output)
        assert answer.exit_code == 0 or answer.output.strip(), words

    tried()


def samples():
    """A fitting value of each kind of object that public functions take."""
    wheel, steel = geometry.wheel_profile("P8"), bem.STEEL
    grid = bem.Grid(-1e-3, -1e-3, 1e-3, 1e-3, 3, 3)
    pressure = np.zeros((3, 3))
    pressure[1, 1] = 1e9
    scene = rail_fem.load_case("case.toml").scene
    result = rail_fem.load_result("run")
    return {type(one): one for one in (wheel, steel, grid, scene, result, bem.Creepage(1e-3),
            bem.Patch(grid, None, pressure, 1e-5, "tested"), geometry.Wheelset(wheel),
            geometry.Track(geometry.rail_head("60E1")), rail_fem.load_sweep("sweep"),
            geometry.CheckRail(), geometry.CastCrossing(), geometry.read_raw("profile.csv", "wheel", 1e-3),
            *vars(scene).values())}  # fmt: skip


def meant(annotation, function):
    """The annotation of a parameter where it stands as text; the text where its names are for type checkers alone."""
    there = {"Path": Path, **{name.partition(".")[2]: one for name, one in EVERY.items()}}
    names = there | vars(sys.modules[function.__module__])
    try:
        return eval(annotation, names) if isinstance(annotation, str) else annotation
    except NameError:
        return annotation


def values_of(annotation, there: dict):
    """Odd values of a parameter's own type; None where nothing is known of it."""
    origin, inner = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        known = [values for one in inner if (values := values_of(one, there)) is not None]
        return st.one_of(known) if known else None
    if origin is tuple and inner and Ellipsis not in inner:
        known = [values_of(one, there) for one in inner]
        return None if None in known else st.tuples(*known)
    if origin is typing.Annotated:
        return values_of(inner[0], there)
    if annotation in there:
        return st.just(there[annotation])
    plain = {float: NUMBERS, int: WHOLE, bool: st.booleans(), np.ndarray: ARRAYS, type(None): st.none(),
             Path: st.sampled_from(FILES).map(Path), str: st.sampled_from([*FILES[:4], *TEXTS])}  # fmt: skip
    if origin is typing.Literal:
        return st.sampled_from([*inner, ""])
    if isinstance(origin, type) and issubclass(origin, typing.Mapping):
        return st.dictionaries(plain[str], st.one_of(plain[str], NUMBERS), max_size=2)
    return plain.get(annotation)


EVERY = {f"{of.__name__}.{name}": getattr(of, name) for of in (rail_fem, geometry, bem) for name in of.__all__}
ERRORS = (ValueError, OSError, KeyError)  # those of the project are of these
FUNCTIONS = {
    name: one
    for name, one in EVERY.items()
    if callable(one) and not (isinstance(one, type) and issubclass(one, ERRORS))
}


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.filterwarnings("ignore")
def test_every_public_function_answers_or_says_why_not(name):
    function, there = FUNCTIONS[name], samples()
    asked = {}
    for key, one in inspect.signature(function).parameters.items():
        values = None if one.kind == one.VAR_KEYWORD else values_of(meant(one.annotation, function), there)
        if values is not None:
            asked[key] = (values, one.default is not one.empty)
        elif one.default is one.empty and one.kind != one.VAR_KEYWORD:
            pytest.skip(f"{key}: {one.annotation} is made by other functions")
    required = {key: values for key, (values, optional) in asked.items() if not optional}
    others = {key: values for key, (values, optional) in asked.items() if optional}

    @settings(FUZZ, max_examples=3 if name.endswith(("figure", "plot_force", "plot_sweep")) else 40)
    @given(st.fixed_dictionaries(required, optional=others))
    def tried(words):
        try:
            function(**words)
        except ERRORS as error:
            assert len(str(error).split()) > 2, (words, repr(error))

    tried()
