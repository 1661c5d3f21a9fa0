"""What all studies share: their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

OUT = Annotated[Path | None, typer.Option("--out", help="folder for tables (.md, .csv) and figure (.png)")]
QUICK = Annotated[bool, typer.Option("--quick", help="a look in short time")]
