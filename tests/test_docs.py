"""The documents name what there is."""

import importlib
import os
import re
import shlex
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
from pydantic import BaseModel
from typer.main import get_command

from rail_fem.case.keys import section_keys
from rail_fem.cli import app
from rail_fem.hierarchy import MODELS
from rail_fem.result.result import Cost, PassResult, PatchSummary, Peak
from rail_fem.scene.scene import Scene
from rail_fem.settings.damage import DamageSettings
from tests.commands import call

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "models").glob("*.md")])


@pytest.mark.parametrize("kind", [PassResult, Peak, PatchSummary, Cost])
def test_every_entry_of_a_result_is_described(kind):
    text = (ROOT / "docs" / "outputs.md").read_text(encoding="utf-8")
    missing = [entry.name for entry in fields(kind) if entry.name != "history" and f"`{entry.name}`" not in text]
    assert not missing, f"docs/outputs.md does not say what {missing} of {kind.__name__} hold"


def tables(section: type[BaseModel]) -> set[type[BaseModel]]:
    """A section of a case file and those beneath it that hold a key."""
    keys = list(section_keys(section))
    inner = [key.section for key in keys if key.section]
    return set().union({section} if len(inner) < len(keys) else set(), *map(tables, inner))


def test_every_key_of_a_case_file_is_looked_up_on_its_page():
    """The page makes its tables from the classes that it names; a casting's holds those of a rail."""
    text = (ROOT / "docs" / "case_file.md").read_text(encoding="utf-8")
    named = [found.partition(":") for found in re.findall(r"```{case-keys} (\S+)", text)]
    shown = {getattr(importlib.import_module(module), name) for module, _, name in named}
    asked = [Scene, DamageSettings, *(entry.settings for entry in MODELS.values())]
    reached = set().union(*map(tables, asked))
    missing = [kind for kind in reached if not any(issubclass(one, kind) for one in shown)]
    assert not missing, f"docs/case_file.md has no keys of {sorted(kind.__name__ for kind in missing)}"


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def own_case() -> str:
    """The section of the first steps that leads from a wheel's file to a curve."""
    text = (ROOT / "docs" / "start.md").read_text(encoding="utf-8")
    return re.search(r"## Your own case, in nine commands\n(.*?)\n### ", text, re.DOTALL)[1]


def printed_by(program: str, folder: Path) -> str:
    """What Python code prints, in a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    answer = subprocess.run(
        [sys.executable, "-c", program], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert answer.returncode == 0, f"{program}\n{answer.stderr[-3000:]}"
    return answer.stdout


def changed(case: Path, lines: str) -> None:
    """Lines `key = value` in place of those that begin with the same key, as a user edits them."""
    text = case.read_text(encoding="utf-8")
    for line in lines.splitlines():
        text, count = re.subn(rf"(?m)^{line.partition(' =')[0]} = .*$", line, text)
        assert count == 1, f"{line} stands for {count} lines of what init writes"
    case.write_text(text, encoding="utf-8")


def test_a_case_of_ones_own_takes_nine_commands():
    """The Python block counts as one."""
    commands = [line for block in blocks(own_case(), "sh") for line in block.splitlines()]
    assert len(commands) + len(blocks(own_case(), "python")) == 9
    assert all(command.startswith(".venv/bin/rail-fem ") for command in commands)


def test_the_first_steps_lead_from_a_wheels_file_to_figure_data_frame_and_curve(tmp_path, monkeypatch):
    """Every command as it stands, in its order, in an empty folder; the explicit run with few steps, where dolfinx
    is."""
    monkeypatch.chdir(tmp_path)
    before, lines, after = own_case(), *blocks(own_case(), "toml"), blocks(own_case(), "python")[0]
    for block in blocks(before, "sh"):
        for command in block.splitlines():
            words = shlex.split(command)[1:]
            if "fe_full" in words:
                pytest.importorskip("dolfinx")
            if words[:2] == ["check", "my_case.toml"]:
                changed(tmp_path / "my_case.toml", lines)
            call(*words, RAIL_FEM_SMOKE=str(int("fe_full" in words)))
            if words[0] == "show":
                forces = [float(word) for word in printed_by(after, tmp_path).split()]
                assert len(forces) == 6 and min(forces) > 50
    for picture in (
        "my_wheel.png",
        "runs/my_case/figures/force.png",
        "runs/my_speeds/figures/impact_on_the_wheel_against_speed.png",
    ):
        assert (tmp_path / picture).stat().st_size > 10_000


COMMAND = re.compile(r"(?<![\w-])rail-fem ([a-z]+[^\n]*)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_printed_commands_and_their_options_exist(page):
    """`rail-fem run CASE --out DIR` in a sentence or a block: the command is one of the program's, its options are the
    command's. The package's name is no command."""
    text = page.read_text(encoding="utf-8")
    known = get_command(app).commands
    spans = [span.replace("\n", " ") for span in re.findall(r"(?<!`)`([^`]+)`(?!`)", text)]
    code = [*blocks(text, "sh"), *spans]
    printed = [found.split() for part in code for found in COMMAND.findall(part)]
    for command, *words in printed:
        assert command in known, f"{page.name}: rail-fem {command} is no command"
        options = {option for one in known[command].params for option in one.opts + one.secondary_opts} | {"--help"}
        asked = {word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)}
        assert command == "study" or asked <= options, f"{page.name}: rail-fem {command} has no {asked - options}"
    wrong = re.findall(rf"(?<!-m )\brail_fem (?:{'|'.join(known)})\b", text)
    assert not wrong, f"{page.name} prints {wrong[0]}, the program is rail-fem"


def targets(text: str) -> list[str]:
    """What the links of a Markdown text lead to, without those to other sites and to sections of the same page."""
    found = re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    return [target.partition("#")[0] for target in found if not re.match(r"https?:|#", target)]


sys.path.append(str(ROOT / "docs" / "_ext"))
from links import judge  # noqa: E402


@pytest.mark.parametrize(
    "infos, wrong, said",
    [
        (["Failed to resolve 'doi.org'", "Connection timed out"], 0, "no network"),
        (["Failed to resolve 'doi.org'", ""], 1, "2 outside link(s), 1 broken"),
        (["404 Client Error: Not Found", "403 Client Error: Forbidden"], 1, "2 outside link(s), 1 broken"),
        (["", ""], 0, "2 outside link(s), 0 broken"),
    ],
)
def test_a_broken_link_is_a_fault_and_no_network_is_not(infos, wrong, said):
    """Publishers that answer programs with 403 are not broken."""
    records = [
        {
            "status": "broken" if info else "working",
            "uri": "https://doi.org/1",
            "info": info,
            "filename": "a",
            "lineno": 1,
        }
        for info in infos
    ]
    sentence, lines = judge([*records, {"status": "unchecked", "uri": "start.html", "info": ""}])
    assert said in sentence and len(lines) == wrong


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_between_documents_lead_somewhere(page):
    gone = [t for t in targets(page.read_text(encoding="utf-8")) if not (page.parent / t).exists()]
    assert not [target for target in gone if target != "gallery/index.rst"], f"{page.name} links to {gone}"
