"""Several damage studies side by side: what each wore off, how sure, and how far they differ."""

import json
import os
from pathlib import Path
from typing import Any

from rail_fem.damage.traffic import time_in_words
from rail_fem.files.markdown import table_of

UM = 1e6


class ComparisonError(ValueError):
    """Studies that cannot stand side by side."""


def is_study(folder: Path) -> bool:
    """Whether a folder holds a finished damage study."""
    return os.path.isfile(Path(folder) / "damage.json")  # False for a name that no file can have


def is_begun(folder: Path) -> bool:
    """Whether a folder holds a damage study, finished or not."""
    try:
        case = json.loads((Path(folder) / "case.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return is_study(folder)
    return isinstance(case, dict) and case.get("study") == "damage"


def studies_facts(folders: list[Path]) -> dict[str, dict[str, Any]]:
    """Results of damage studies by folder. Errors: ComparisonError for a folder that holds none, or one that is
    damaged."""
    found = {}
    for folder in map(Path, folders):
        if not is_study(folder) and is_begun(folder):
            raise ComparisonError(f"{folder}: a damage study that has not ended; go on with rail-fem damage --restart")
        if not is_study(folder):
            raise ComparisonError(f"{folder}: no damage.json; a damage study is compared with others of its kind")
        try:
            found[str(folder)] = json.loads((folder / "damage.json").read_text(encoding="utf-8"))
        except ValueError as error:
            raise ComparisonError(f"{folder / 'damage.json'}: damaged ({error}): do the study again") from error
    sites = {facts["site"] for facts in found.values()}
    if len(sites) > 1:
        raise ComparisonError(f"studies of a {' and a '.join(sorted(sites))}: compare those of one kind")
    return found


def _of_before(facts: dict[str, Any]) -> dict[str, Any]:
    """The one part of a section whose numbers stood among those of the study."""
    tgamma = facts["tgamma"]
    largest = {"largest_tgamma": tgamma["largest"], "at_end": {"largest_tgamma": tgamma["largest_at_end"]}}
    return {"section": facts | largest}


def studies_table(folders: list[Path]) -> str:
    """Markdown table, a row for each part of each study. Errors: ComparisonError."""
    rows = []
    for name, facts in studies_facts(folders).items():
        for part, own in (facts.get("bodies") or _of_before(facts)).items():
            band = list(own["deepest_by_law"].values())
            rows.append(
                {
                    "study": Path(name).name,
                    "part": part,
                    "passes": f"{facts['passes']:,.0f}",
                    "deepest [\u00b5m]": f"{own['deepest_by_law'][facts['law']] * UM:.3g}",
                    "band over the laws [\u00b5m]": f"{min(band) * UM:.3g} to {max(band) * UM:.3g}",
                    "bound of the blocks' error": f"{facts['block_error']:.1%}",
                    "T\u03b3 first, end [N]": f"{own['largest_tgamma']:.0f}, {own['at_end']['largest_tgamma']:.0f}",
                    "time to the limit": time_in_words(own["years"]["to_limit"]),
                }
            )
    return "\n".join(table_of(rows))
