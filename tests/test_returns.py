"""What functions hand back has names: a swapped pair among many values by position is seen by nobody."""

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MOST = 4
# components of a vector or of a symmetric tensor, held in registers; numbers of one row, in the order of its columns
VECTORS = {
    "rail_fem/fe/trilinear.py": {"scalar_modes", "by_mode"},
    "rail_fem/fe/elastic.py": {"shape_gradients"},
    "rail_fem/fe/finite_strain.py": {"rotate_stress", "add_elastic"},
    "rail_fem/contact/patch_methods.py": {"_numbers"},
}


def returned(function: ast.FunctionDef) -> Iterator[ast.expr | None]:
    """Values of a function's own return statements."""
    ahead: list[ast.AST] = list(function.body)
    while ahead:
        node = ahead.pop()
        if isinstance(node, ast.Return):
            yield node.value
        if not isinstance(node, (ast.FunctionDef, ast.Lambda, ast.ClassDef)):
            ahead.extend(ast.iter_child_nodes(node))


def test_no_function_returns_five_values_by_position():
    found = []
    for package in ("geometry", "bem", "rail_fem"):
        for path in sorted((ROOT / package).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.FunctionDef) and node.name not in VECTORS.get(name, ()):
                    count = max((len(v.elts) for v in returned(node) if isinstance(v, ast.Tuple)), default=0)
                    if count > MOST:
                        found.append(f"{name}:{node.lineno} {node.name} returns {count}")
    assert not found, f"give these a NamedTuple (numba takes it): {'; '.join(found)}"
