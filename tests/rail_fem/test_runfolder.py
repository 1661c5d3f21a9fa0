import pytest

from rail_fem.result.runfolder import MARK, RunFolderError, fingerprint, prepare_folder
from rail_fem.settings.explicit import FeSettings
from tests.rail_fem.test_scene import make_scene

CASE = fingerprint("fe_full", make_scene(), FeSettings(element_size="1.5 mm"))


def test_new_and_empty_folders_start_afresh(tmp_path):
    assert prepare_folder(tmp_path / "a" / "b", CASE) is False
    (tmp_path / "empty").mkdir()
    assert prepare_folder(tmp_path / "empty", CASE, restart=True) is False


def test_folder_of_a_run_is_only_gone_on_with_or_emptied_when_asked(tmp_path):
    prepare_folder(tmp_path, CASE)
    (tmp_path / "history.csv").write_text("old")
    with pytest.raises(RunFolderError, match="--restart goes on with it, --overwrite begins again"):
        prepare_folder(tmp_path, CASE)
    assert prepare_folder(tmp_path, CASE, restart=True) is True
    assert (tmp_path / "history.csv").read_text() == "old"
    (tmp_path / "fields").mkdir()
    (tmp_path / "fields" / "frame.vtu").write_text("old")
    assert prepare_folder(tmp_path, CASE, overwrite=True) is False
    assert [path.name for path in tmp_path.iterdir()] == [MARK]


def test_restart_of_another_case_names_what_differs(tmp_path):
    prepare_folder(tmp_path, CASE)
    other = fingerprint("fe_full", make_scene(speed="50 mph"), FeSettings(element_size="2 mm"))
    with pytest.raises(RunFolderError) as error:
        prepare_folder(tmp_path, other, restart=True)
    assert "2 difference(s)" in str(error.value)
    assert "scene.speed: 33.528 there, 22.352 in this case (SI)" in str(error.value)
    assert "run.fe_full.element_size: 0.0015 there, 0.002 in this case (SI)" in str(error.value)


def test_restart_may_change_how_often_it_saves_and_where_it_stops(tmp_path):
    prepare_folder(tmp_path, CASE)
    assert prepare_folder(
        tmp_path,
        fingerprint("fe_full", make_scene(), FeSettings(element_size="1.5 mm", max_steps=7, checkpoint_interval="5 s")),
        restart=True,
    )


@pytest.mark.parametrize("options", [{}, {"restart": True}, {"overwrite": True}])
def test_foreign_files_are_never_touched(tmp_path, options):
    (tmp_path / "thesis.doc").write_text("years of work")
    with pytest.raises(RunFolderError, match="no run wrote, the first is thesis.doc"):
        prepare_folder(tmp_path, CASE, **options)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.doc"]


def test_restart_and_overwrite_together_are_refused(tmp_path):
    prepare_folder(tmp_path, CASE)
    with pytest.raises(RunFolderError, match="one of the two"):
        prepare_folder(tmp_path, CASE, restart=True, overwrite=True)


def test_a_file_in_the_way_is_a_fault(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(RunFolderError, match="a file of that name exists"):
        prepare_folder(tmp_path / "out", CASE)


def test_folder_that_cannot_exist_is_a_fault(tmp_path):
    """As root nothing is read-only but what is no folder at all."""
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="choose a folder that can be written"):
        prepare_folder(tmp_path / "file" / "out", CASE)
