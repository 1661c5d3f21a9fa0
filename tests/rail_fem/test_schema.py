"""The schema of case files says what the program says: every shipped case fits it, what the program refuses by its form
does not."""

import json
import re
import tomllib
from pathlib import Path

import pytest

from rail_fem.case.casefile import CaseError, load_case
from rail_fem.case.keys import section_keys
from rail_fem.case.schema import SCHEMA_FILE, case_schema
from rail_fem.hierarchy import MODELS
from rail_fem.scene.scene import Scene
from rail_fem.scene.units import parse
from tests.commands import call

ROOT = Path(__file__).resolve().parents[2]
CASES = sorted((ROOT / "cases").rglob("case_*.toml")) + sorted((ROOT / "cases").glob("*.toml"))
REFERENCE = ROOT / "cases" / "nose_transfer.toml"


@pytest.fixture(scope="module")
def schema():
    return case_schema()


def definition(schema: dict, key: dict) -> dict:
    reference = key.get("$ref") or key["allOf"][0]["$ref"]
    found = schema["definitions"][reference.rpartition("/")[2]]
    return found["anyOf"][1] if "anyOf" in found else found


@pytest.fixture(scope="module")
def checker(schema):
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft7Validator.check_schema(schema)
    return jsonschema.Draft7Validator(schema)


def test_every_key_has_its_meaning_range_and_a_default_that_the_program_reads(schema):
    sections = {Scene: schema["properties"]["scene"]}
    sections |= {model.settings: schema["properties"]["run"]["properties"][name] for name, model in MODELS.items()}
    count = 0
    for section, key in sections.items():
        made = definition(schema, key)
        assert made["additionalProperties"] is False
        for known in section_keys(section):
            told = made["properties"][known.name]
            assert known.meaning in told["description"]
            if known.unit:
                assert known.unit in told["description"] and told.get("anyOf", [told])[0]["type"] in ("string", "array")
                if "default" in told:
                    assert parse(told["default"], known.unit)[1] == pytest.approx(parse(known.default, known.unit)[1])
                    count += 1
    assert count > 20


def test_scene_and_settings_give_schemas_of_their_own():
    for section in (Scene, *(model.settings for model in MODELS.values())):
        json.dumps(section.model_json_schema())


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_every_shipped_case_fits(checker, path):
    with path.open("rb") as stream:
        assert [error.message for error in checker.iter_errors(tomllib.load(stream))] == []


@pytest.mark.parametrize("model", MODELS)
def test_a_new_case_file_names_the_schema_beside_it_and_fits_it(checker, tmp_path, model):
    file = tmp_path / "case.toml"
    call("init", file, "--model", model)
    text = file.read_text(encoding="utf-8")
    assert text.splitlines()[0] == f"#:schema ./{SCHEMA_FILE}"
    assert json.loads((tmp_path / SCHEMA_FILE).read_text(encoding="utf-8")) == case_schema()
    assert list(checker.iter_errors(tomllib.loads(text))) == []
    said, count = re.subn('^# (.* = "none")', r"\1", text, flags=re.MULTILINE)
    assert count and list(checker.iter_errors(tomllib.loads(said))) == []
    before = load_case(file)
    file.write_text(said, encoding="utf-8")
    assert (load_case(file).scene, load_case(file).runs) == (before.scene, before.runs)


@pytest.mark.parametrize(
    ("was", "is_"),
    [
        ('speed = "75 mph"', "speed = 75"),
        ('speed = "75 mph"', 'sped = "75 mph"'),
        ('speed = "75 mph"', 'speed = "75"'),
        ('direction = "facing"', 'direction = "forward"'),
        ('wing = "Mn13"', 'wing = "Mn14"'),
        ("[run.fe_full]", "[run.fe_ful]"),
        ("friction = 0.3", "friction = 30"),
        ('speed = "75 mph"\n', ""),
    ],
)
def test_what_the_schema_refuses_the_program_refuses(checker, tmp_path, was, is_):
    text = REFERENCE.read_text(encoding="utf-8")
    assert was in text
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(text.replace(was, is_, 1), encoding="utf-8")
    assert list(checker.iter_errors(tomllib.loads(wrong.read_text(encoding="utf-8"))))
    with pytest.raises(CaseError):
        load_case(wrong)


def test_the_schema_alone_is_one_command(tmp_path):
    call("list", "--schema", tmp_path / "s.json")
    assert json.loads((tmp_path / "s.json").read_text(encoding="utf-8"))["title"] == "rail-fem case file"
