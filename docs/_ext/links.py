"""What Sphinx' linkcheck found, judged: `python docs/_ext/links.py docs/_build/links/output.json`.

A link that a server refuses or does not know is a fault; where no outside link could be reached at all there is no
network, and nothing has been checked.
"""

import json
import sys
from pathlib import Path

NO_ANSWER = ("resolve", "connect", "timed out", "timeout", "unreachable", "proxy", "retries")
BOTS_REFUSED = ("401", "403", "418", "429")  # publishers' answers to programs


def judge(lines: list[dict]) -> tuple[str, list[str]]:
    """A sentence, and a line for each broken link. lines : linkcheck's records with status, uri, info, filename."""
    outside = [line for line in lines if line["uri"].startswith("http")]
    broken = [line for line in outside if line["status"] in ("broken", "timeout")]
    silent = [line for line in broken if any(word in line["info"].lower() for word in NO_ANSWER)]
    if outside and len(silent) == len(outside):
        return f"no network: none of {len(outside)} outside link(s) could be tried, nothing was checked", []
    wrong = [line for line in broken if not any(code in line["info"] for code in BOTS_REFUSED)]
    said = [f"{line['filename']}:{line['lineno']}: {line['uri']}: {line['info']}" for line in wrong]
    return f"{len(outside)} outside link(s), {len(wrong)} broken", said


def main(path: Path) -> int:
    """Print the judgement; 1 where a link is broken or nothing was written."""
    if not path.is_file():
        print(f"{path}: not there, linkcheck did not run to its end")
        return 1
    sentence, wrong = judge([json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line])
    print(f"links: {sentence}", *wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1])))
