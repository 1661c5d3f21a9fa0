"""A mesh is made once for all runs on the same shapes, never taken for another's or a damaged one, never executed."""

import os
import pickle
from dataclasses import fields
from functools import partial

import numpy as np
import pytest

import kernel_cache
from geometry.meshing import blocks
from geometry.meshing.blocks import mesh_cap
from rail_fem.case.estimate import MESHING, estimate_run, foretold
from rail_fem.contact.rigid import anchored_path, meshed_stretch
from rail_fem.fe.plan import kept_meshes
from rail_fem.fe.plan.kept_meshes import body_meshes, is_kept, kept
from rail_fem.settings.explicit import FeSettings
from tests.rail_fem.test_scene import make_scene

SETTINGS = FeSettings(element_size=5e-3, start=0.3, end=0.4)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, "lasting_folder", lambda: tmp_path)
    return tmp_path / "meshes"


def cap(size: float = 1e-3):
    return partial(mesh_cap, np.inf, np.inf, (6e-3, 5e-3), 5e-3, size, (3e-3, 2e-3, 2e-3), facing="up", name="cap")


def same(one, two) -> bool:
    pairs = [(getattr(one, field.name), getattr(two, field.name)) for field in fields(one)]
    return all(a == b if isinstance(a, tuple) else a.dtype == b.dtype and np.array_equal(a, b) for a, b in pairs)


def meshers(settings=SETTINGS, **changes):
    scene = make_scene().replace_si(**changes)
    return body_meshes(scene, settings, anchored_path(scene, *meshed_stretch(scene, settings)))


def test_a_mesh_that_is_kept_is_the_one_that_is_made(folder):
    made = cap()()
    assert not is_kept(cap()) and same(kept(cap()), made) and is_kept(cap())
    assert same(kept(cap()), made) and len(list(folder.iterdir())) == 1
    assert not is_kept(cap(0.9e-3)) and not is_kept(partial(cap(), facing="down"))


def test_other_speeds_loads_and_steels_find_the_meshes_other_shapes_do_not():
    """By the file that each mesh would have, nothing meshed: a change of what no mesher reads changes none, a change of
    shape or size those of the bodies that it moves."""
    of = lambda *given, **changes: [kept_meshes._file(one) for one in meshers(*given, **changes)]
    here = of()
    assert None not in here and len(set(here)) == len(here) >= 2
    assert here == of(speed=20.0, friction=0.5, foundation={"stiffness": 50e6}, materials={"nose": {"grade": "R260"}})
    for change in ({"wheel": {"radius": 0.45}}, {"crossing": {"ratio": 9.25}}, {"back_to_back": 1.362}):
        assert not set(here) & set(of(**change)), change
    assert not set(here) & set(of(SETTINGS.model_copy(update={"element_size": 4e-3})))
    deeper = of(SETTINGS.model_copy(update={"wheel_depth": 0.1}))
    assert deeper[:-1] == here[:-1] and deeper[-1] != here[-1]


def test_the_time_foretold_is_less_by_the_meshes_that_are_kept(monkeypatch):
    """Those of a twin with them; another shape is meshed."""
    twin, scene = SETTINGS.model_copy(update={"error_twin": True}), make_scene()
    fresh = [foretold(scene, settings) for settings in (SETTINGS, twin)]
    files = {kept_meshes._file(one) for one in meshers()}
    monkeypatch.setattr(kept_meshes, "is_kept", lambda mesher: kept_meshes._file(mesher) in files)
    saved = [one.wall_time - foretold(scene, settings).wall_time for one, settings in zip(fresh, (SETTINGS, twin))]
    assert 0 < MESHING < saved[0] < saved[1] < fresh[1].preparation
    assert foretold(scene.replace_si(wheel={"radius": 0.45}), SETTINGS).preparation == fresh[0].preparation
    ends = SETTINGS.model_copy(update={"end": scene.crossing.surface.x_range[1]})
    assert foretold(scene, ends) == estimate_run(scene, ends)  # no wheel stands there


def test_an_edited_mesher_finds_none_of_its_old_meshes(monkeypatch):
    kept(cap())
    monkeypatch.setattr(kernel_cache, "digest", lambda file: "edited" if str(file) == blocks.__file__ else "")
    assert not is_kept(cap())


class Bomb:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


@pytest.mark.parametrize("fault", ["cut", "altered", "another's", "pickle", "objects"])
def test_what_is_damaged_or_a_strangers_is_made_anew_and_never_executed(folder, fault, tmp_path):
    made = kept(cap())
    (file,) = folder.iterdir()
    content = bytearray(file.read_bytes())
    if fault == "cut":
        file.write_bytes(content[: len(content) // 2])
    elif fault == "altered":
        content[content.index(made.points.tobytes()) + 5] ^= 1
        file.write_bytes(content)
    elif fault == "another's":
        kept(cap(0.9e-3))
        (other,) = set(folder.iterdir()) - {file}
        other.replace(file)
    elif fault == "pickle":
        file.write_bytes(pickle.dumps(Bomb(tmp_path / "bomb")))
    else:
        np.savez(file, seal=np.zeros(1, np.uint8), points=np.array([Bomb(tmp_path / "bomb")], object))
    assert same(kept(cap()), made) and same(kept(cap()), made)
    assert not (tmp_path / "bomb").exists()


def test_those_asked_for_last_stay_when_there_are_too_many(folder, monkeypatch):
    kept(cap())
    (file,) = folder.iterdir()
    monkeypatch.setattr(kept_meshes, "MOST_BYTES", 2.5 * file.stat().st_size)
    kept(cap(0.999e-3))  # as many cells
    for age, entry in enumerate(folder.iterdir()):
        os.utime(entry, (1e9 + age, 1e9 + age))
    kept(cap())
    kept(cap(0.998e-3))
    assert is_kept(cap()) and is_kept(cap(0.998e-3)) and not is_kept(cap(0.999e-3))


def test_what_is_not_known_by_its_content_is_not_kept(folder):
    odd = partial(lambda mesh, of: mesh, cap()(), object())
    assert kept_meshes._file(odd) is None and same(kept(odd), cap()()) and not folder.exists()


def test_without_a_lasting_cache_meshes_are_made(folder, monkeypatch):
    monkeypatch.setattr(kernel_cache, "lasting_folder", lambda: None)
    assert same(kept(cap()), cap()()) and not is_kept(cap()) and not folder.exists()
