"""The trust report as text, from what a result holds: the rows of an explicit run, and for every model what it warns
of."""

from collections.abc import Mapping, Sequence
from typing import Any

GOOD = "good"


def trust_text(trust: Mapping[str, Any], warnings: Sequence[str]) -> str:
    """The report. trust : "rows" of name, value, shown, rule, verdict, and "slowest" elements in words, both by
    choice"""
    lines, rows = ["how far to trust this run"], trust.get("rows", ())
    width = max((len(row["name"]) for row in rows), default=0)
    lines += [f"  {row['verdict']:8s} {row['name']:{width}s}  {row['shown']}  (rule: {row['rule']})" for row in rows]
    lines += [f"  {len(warnings)} warning(s)", *(f"    {warning}" for warning in warnings)]
    if trust.get("slowest"):
        lines += ["  elements with the smallest stable step:", *(f"    {text}" for text in trust["slowest"])]
    return "\n".join(lines) + "\n"


def verdict_words(trust: Mapping[str, Any]) -> str:
    """The rows that are not good, in a line: "good" where all are, "" for a model without rows."""
    rows = trust.get("rows", ())
    short = [f"{row['name']} {row['short']}" for row in rows if row["verdict"] != GOOD]
    return f"{len(short)} of {len(rows)} rows fail: {'; '.join(short)}" if short else GOOD if rows else ""
