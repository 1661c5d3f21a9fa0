"""Sphinx configuration: `python -m sphinx -W -b html docs docs/_build/html` builds everything, the gallery's scripts
included."""

import sys
import warnings
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "docs" / "_ext")]

project = "rail-fem"
author = copyright = "the rail-fem developers"
release = metadata.version("rail-fem")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
    "case_reference",
    "argument_lists",
]
exclude_patterns = ["_build", "examples/README.rst"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "rail-fem"
autodoc_typehints = "description"
autodoc_member_order = "bysource"
suppress_warnings = ["config.cache"]  # the gallery's reset functions cannot be pickled; nothing is lost by it

sphinx_gallery_conf = {
    "examples_dirs": "examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/plot_",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "remove_config_comments": True,
    "ignore_pattern": r"coarse_pass\.py",
    "matplotlib_animations": True,
    "show_memory": False,
    "first_notebook_cell": "%matplotlib inline",  # without it some releases show a figure's name in place of it
}
warnings.filterwarnings("ignore", message="Matplotlib is currently using agg")
