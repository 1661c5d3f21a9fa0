"""A wheel puts every package beneath rail_fem: `geometry`, `bem` and `kernel_cache` are names of folders in a checkout,
and too general for anybody's site-packages.

What is built is copied as it stands but for its import statements, `from geometry.axes import VOIGT` becomes
`from rail_fem.geometry.axes import VOIGT`. Editable installs keep the folders; rail_fem answers to the
same names there. All else is in pyproject.toml.
"""

import re
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HOME, PARTS = "rail_fem", ("geometry", "bem", "kernel_cache")
IMPORT = re.compile(rf"^(\s*)(?:from ({'|'.join(PARTS)})\b|import ((?:{'|'.join(PARTS)})(?: as \w+)?)$)", re.MULTILINE)


def beneath(name: str) -> str:
    """A package's name where it is installed."""
    return f"{HOME}.{name}" if name.partition(".")[0] in PARTS else name


def rewritten(text: str) -> str:
    """A module's text with its import statements as they are beneath rail_fem."""
    return IMPORT.sub(
        lambda found: f"{found[1]}from {HOME}.{found[2]}" if found[2] else f"{found[1]}from {HOME} import {found[3]}",
        text,
    )


class BuildBeneath(build_py):
    """Packages and modules of a wheel by the names that they are installed by."""

    def run(self) -> None:
        if not self.editable_mode:
            self.packages = self.distribution.packages = [beneath(package) for package in self.packages]
            self.package_dir = {beneath(part): part for part in PARTS}
            self.py_modules = self.distribution.py_modules = None
        super().run()

    def build_packages(self) -> None:
        super().build_packages()
        self.build_module("kernel_cache", "kernel_cache.py", HOME)

    def build_module(self, module: str, module_file: str, package: str) -> tuple[str, bool]:
        made, copied = super().build_module(module, module_file, package)
        path = Path(made)
        path.write_text(rewritten(path.read_text(encoding="utf-8")), encoding="utf-8")
        return made, copied


setup(cmdclass={"build_py": BuildBeneath})
