"""The documents name what there is."""

from dataclasses import fields
from pathlib import Path

import pytest

from rail_fem.output.result import Cost, PassResult, PatchSummary, Peak

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("kind", [PassResult, Peak, PatchSummary, Cost])
def test_every_entry_of_a_result_is_described(kind):
    text = (ROOT / "docs" / "outputs.md").read_text(encoding="utf-8")
    missing = [entry.name for entry in fields(kind) if entry.name != "history" and f"`{entry.name}`" not in text]
    assert not missing, f"docs/outputs.md does not say what {missing} of {kind.__name__} hold"
