"""Base of every typed section of a case: immutable, no unknown keys, changed by copies."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Strict
from pydantic_core import PydanticCustomError

PRINTABLE = r"^[^\x00-\x1f\x7f-\x9f]*$"  # one line without control characters

GRAVITY = 9.81  # [m/s2]
Count = Annotated[int, Strict()]  # true is no count of 1


class Frozen(BaseModel):
    """Base of every typed section of a case: immutable, no unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def replace(self, **changes: Any) -> Self:
        """The same section with other values, each checked as a case file's: text with its unit, or a number in SI; a
        dict changes a part.

            scene.replace(speed="100 mph", foundation={"stiffness": "160 kN/mm"})

        Errors: pydantic.ValidationError (a ValueError) that names every key at fault.
        """
        return self._replaced(changes, {})

    def _replaced(self, changes: Mapping[str, Any], context: dict[str, Any]) -> Self:
        values = {name: getattr(self, name) for name, field in type(self).model_fields.items() if not field.exclude}
        for name, change in changes.items():
            part = values.get(name)
            values[name] = (
                part.replace(**change) if isinstance(part, Frozen) and isinstance(change, Mapping) else change
            )
        return type(self).model_validate(values, context=context)


def digest_of_read(stated: str, read: Any) -> str:
    """Digest of what a file held: that of `read`, which has `source` and `digest`; "" where nothing was read.

    Errors: PydanticCustomError where a scene states another one, that is, where the file has changed since.
    """
    found = read.digest if read else ""
    if stated and read and stated != found:
        raise input_error(
            "changed_file", f"{read.source} has other content ({found[:12]}) than is stated ({stated[:12]})"
        )
    return found


def input_error(kind: str, text: str, **about: str) -> PydanticCustomError:
    """A fault in words. key : which field the fault is of, where another one met it"""
    return PydanticCustomError(kind, "{message}", {"message": text, **about})
