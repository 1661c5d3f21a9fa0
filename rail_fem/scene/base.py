"""Base of every typed section of a case: immutable, no unknown keys, changed by copies."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    Strict,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from rail_fem.scene.input_errors import faults_of, quantity_of, table_of

PRINTABLE = r"^[^\x00-\x1f\x7f-\x9f]*$"  # one line without control characters
KEPT_SECTIONS = "crossing_sections.csv"  # in the folder of a run that used sections
STEP_SUFFIXES = (".step", ".stp")

GRAVITY = 9.81  # [m/s2]
Count = Annotated[int, Strict()]  # true is no count of 1
FileName = Annotated[str, Field(max_length=400, pattern=PRINTABLE)]  # a path beside the case file


class InputError(ValueError):
    """Values that a section does not take. faults : key ("" for the section itself) and remedy of each, in the words of
    a case file's errors"""

    def __init__(self, faults: list[tuple[str, str]]):
        super().__init__("; ".join(": ".join(filter(None, fault)) for fault in faults))
        self.faults = faults


class Frozen(BaseModel):
    """Base of every typed section of a case: immutable, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _none_is_a_word(cls, values: Any) -> Any:
        """TOML has no null: of a key that may be left out "none" says so, as `rail-fem init` writes it."""
        if not isinstance(values, Mapping):
            return values
        own = cls.model_fields
        left_out = {key for key, value in values.items() if isinstance(value, str) and value == "none" and key in own}
        return {**values, **{key: None for key in left_out if own[key].default is None}}

    @classmethod
    def checked(cls, values: Mapping[str, Any], context: dict[str, Any] | None = None) -> Self:
        """The section of these values, each checked as a case file's. Errors: InputError that names every key at
        fault."""
        try:
            return cls.model_validate(dict(values), context=context)
        except ValidationError as error:
            raise InputError(faults_of(error, cls, "")) from None

    @classmethod
    def as_written(cls, values: Mapping[str, Any]) -> Self:
        """As `checked`, which takes a number as SI; here one without its unit is a fault, as in a case file."""
        if bare := _bare_numbers(cls, values, f"{cls.__name__}.checked takes SI"):
            raise InputError(bare)
        return cls.checked(values)

    def replace(self, **changes: Any) -> Self:
        """The same section with other values, each checked as a case file's.

        Parameters
        ----------
        **changes
            Text with its unit, by key; a dict changes a part:
            `scene.replace(speed="100 mph", foundation={"stiffness": "160 kN/mm"})`.

        Returns
        -------
        The same class.

        Raises
        ------
        ValueError
            (InputError) that names every key at fault, also a bare number where a unit belongs.
        """
        if bare := _bare_numbers(type(self), changes, "replace_si takes SI"):
            raise InputError(bare)
        return self.replace_si(**changes)

    def replace_si(self, **changes: Any) -> Self:
        """As replace, for values that are computed: a number is in SI."""
        return self._replaced(changes, {})

    def _replaced(self, changes: Mapping[str, Any], context: dict[str, Any]) -> Self:
        values = {name: getattr(self, name) for name, field in type(self).model_fields.items() if not field.exclude}
        for name, change in changes.items():
            part = values.get(name)
            if isinstance(part, Frozen) and isinstance(change, Mapping):
                change = _replaced_part(name, part, change)
            values[name] = change
        return type(self).checked(values, context)


def _replaced_part(name: str, part: Frozen, change: Mapping[str, Any]) -> Frozen:
    try:
        return part.replace_si(**change)
    except InputError as error:
        raise InputError([(f"{name}.{key}" if key else name, remedy) for key, remedy in error.faults]) from None


def _bare_numbers(section: type[BaseModel], changes: Mapping[str, Any], otherwise: str) -> list[tuple[str, str]]:
    """Key and remedy of each number, also in a list, that has no unit though its key has one; otherwise : what takes
    it."""
    found = []
    for name, value in changes.items():
        field = section.model_fields.get(name)
        if field is None:
            continue
        quantity, table = quantity_of(field), table_of(field.annotation)
        if isinstance(value, Mapping):
            inner = _bare_numbers(table, value, otherwise) if table else []
            found += [(f"{name}.{key}", remedy) for key, remedy in inner]
        elif quantity is not None:
            entries = value if isinstance(value, (list, tuple)) else [value]
            remedies = (quantity.without_unit(entry) for entry in entries)
            found += [(name, f"{remedy}, or {otherwise}") for remedy in remedies if remedy]
    return found


class FromFile(Frozen):
    """A section that names a file, which is read once: the field READ holds what was read, with `source` and `digest`,
    or nothing; the field `digest` what it held. A run keeps a copy of it under the name KEPT."""

    READ: ClassVar[str]
    KEPT: ClassVar[str]
    TOLD: ClassVar[frozenset[str]]  # keys by which a file is read anew

    @field_validator("digest", check_fields=False)
    @classmethod
    def _is_what_was_read(cls, stated: str, info: ValidationInfo) -> str:
        """Errors: PydanticCustomError where a scene states another one, that is, where the file has changed since."""
        read = info.data.get(cls.READ)
        found = read.digest if read else ""
        if stated and read and stated != found:
            raise input_error(
                "changed_file", f"{read.source} has other content ({found[:12]}) than is stated ({stated[:12]})"
            )
        return found

    @classmethod
    def path_of(cls, file: str, info: ValidationInfo, or_else: str = "") -> str:
        """Where a file lies that was not read before: in a run's folder, or beside the case file. or_else : what may
        stand there instead. Errors: PydanticCustomError where there is none."""
        context = info.context or {}
        in_run = "run_folder" in context
        path = Path(context["run_folder"]) / cls.KEPT if in_run else Path(context.get("folder", ".")) / file
        if not os.path.exists(path):
            remedy = f"give a path relative to the case file, {or_else}or the {cls.KEPT} of a run that has used it"
            raise input_error("absent_file", f'no file "{path.name}" in {path.parent}: {remedy}')
        return str(path)

    def replace_si(self, **changes: Any) -> Self:
        """As Frozen.replace_si; a file that stays is not read again."""
        if not self.TOLD & set(changes):
            return self._replaced(changes, {"kept": getattr(self, self.READ)})
        return self._replaced({"digest": ""} | changes, {})


def kept(file: str, info: ValidationInfo) -> Any:
    """What was read of this file before, where the context holds it."""
    found = (info.context or {}).get("kept")
    return found if found is not None and found.source == file else None


def input_error(kind: str, text: str, **about: str) -> PydanticCustomError:
    """A fault in words. key : which field the fault is of, where another one met it"""
    return PydanticCustomError(kind, "{message}", {"message": text, **about})
