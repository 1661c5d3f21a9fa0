"""Size of the house: python tests/house.py [--way]. What it counts is what a reader pays for.

code lines      source without blanks, comments and docstrings
laboratory      of these, what only studies, verification or tests reach: by imports wherever they stand, and by
                modules named in text (models, public names), from all commands but `study`
circles         groups of files that import one another, by either means
way             files of which a function runs in `rail-fem run` by rigid_hertz (--way: runs it, half a minute)
"""

import ast
import re
import runpy
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("geometry", "bem", "rail_fem")
FACES = {*PACKAGES, "rail_fem.hierarchy"}  # name modules in text by their trade
STUDY = "rail_fem.commands.study"


def sources() -> dict[str, Path]:
    """Module -> file."""
    files = [ROOT / "kernel_cache.py", *(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))]
    name = lambda path: ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    return {name(path): path for path in sorted(files)}


def code_lines(path: Path) -> int:
    """Lines without blanks, comments and docstrings."""
    text = path.read_text(encoding="utf-8")
    idle = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            idle |= set(range(node.lineno, node.end_lineno + 1))
    lines = enumerate(text.splitlines(), 1)
    return sum(1 for number, line in lines if number not in idle and line.strip() and not line.strip().startswith("#"))


def needs(path: Path, known: set[str], by_text: bool = True) -> set[str]:
    """Modules that a file imports, or names in text ("module" or "module:name"; of its own package ".module")."""
    found, package = set(), ".".join(path.parent.relative_to(ROOT).parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & known
            found |= inner or {node.module}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif by_text and isinstance(node, ast.Constant) and isinstance(node.value, str):
            name = node.value.partition(":")[0]
            found.add(f"{package}{name}" if name.startswith(".") else name)
    return found & known


def reached(start: set[str], graph: dict[str, set[str]]) -> set[str]:
    """All that these need, themselves among them."""
    seen, ahead = set(), set(start)
    while ahead:
        seen |= ahead
        ahead = set().union(*(graph[name] for name in ahead)) - seen
    return seen


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Groups of modules that need one another."""
    below = {name: reached(graph[name], graph) for name in graph}
    groups = {frozenset(one for one in below[name] if name in below[one]) for name in graph if name in below[name]}
    return sorted(map(set, groups), key=sorted)


def way() -> set[str]:
    """Files of which a function runs in a run by rigid_hertz."""
    met: set[str] = set()

    def watch(frame, event, _):
        if event == "call" and frame.f_code.co_name != "<module>":
            met.add(frame.f_code.co_filename)

    with tempfile.TemporaryDirectory() as out:
        case = str(ROOT / "cases/thesis/case_02.toml")
        sys.argv = ["rail-fem", "--quiet", "run", case, "--model", "rigid_hertz", "--out", f"{out}/run"]
        sys.path.insert(0, str(ROOT))
        sys.setprofile(watch)
        try:
            runpy.run_module("rail_fem", run_name="__main__")
        except SystemExit as end:
            if end.code:
                raise
        finally:
            sys.setprofile(None)
    return met & {str(path) for path in sources().values()}


def words() -> int:
    """Of the documents, as `wc -w` counts them."""
    return sum(len(p.read_text(encoding="utf-8").split()) for p in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def main() -> None:
    files = sources()
    size = {name: code_lines(path) for name, path in files.items()}
    graph = {name: needs(path, set(files), name != STUDY) - {name} for name, path in files.items()}
    inner = {name: others - FACES if name not in FACES else set() for name, others in graph.items()}
    roots = {name for name in files if name.startswith("rail_fem.commands")} | {*FACES, "rail_fem.__main__"}
    laboratory = {name for name in set(files) - reached(roots, graph) if files[name].name != "__init__.py"}
    print(f"| | |\n|---|---|\n| code lines of source | {sum(size.values()):,} in {len(files)} files |")
    print(f"| only reached by studies or tests | {sum(size[n] for n in laboratory):,} in {len(laboratory)} files |")
    studies = re.findall(r'^    "[\w-]+":', files[STUDY].read_text(encoding="utf-8"), re.MULTILINE)
    print(f"| studies | {len(studies)} |")
    print(f"| words of documents | {words():,} |")
    print(f"| circles | {len(circles(inner))}{''.join('; ' + ', '.join(sorted(c)) for c in circles(inner))} |")
    if "--way" in sys.argv[1:]:
        print(f"| files on the way of `run` by rigid_hertz | {len(way())} |")
    rooms = Counter()
    for name in files:
        rooms[".".join(name.split(".")[:2]) if len(name.split(".")) > 2 else name.split(".")[0]] += size[name]
    print("\n".join(["\n| room | code lines |\n|---|---|", *(f"| {r} | {n:,} |" for r, n in rooms.most_common())]))


if __name__ == "__main__":
    main()
