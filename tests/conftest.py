"""At the end of a run: which tests were not run because files of others are not at hand, and where those can be had."""

from tests.outside import ABSENT, report


def pytest_terminal_summary(terminalreporter):
    skipped: dict[str, list[str]] = {}
    for entry in terminalreporter.stats.get("skipped", []):
        reason = entry.longrepr[2] if isinstance(entry.longrepr, tuple) else str(entry.longrepr)
        if ABSENT in reason:
            skipped.setdefault(reason.partition(ABSENT)[2].strip(), []).append(entry.nodeid)
    if skipped:
        terminalreporter.section("not run: outside files", sep="=", yellow=True, bold=True)
        for line in report(skipped):
            terminalreporter.line(line, yellow=True)
