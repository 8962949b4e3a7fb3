"""The base class of all tables of a recipe: values that are checked and do not change."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, ValidationError, field_validator, model_validator

from debulk._core import InputError
from debulk.arguments import of_type
from debulk.recipe.errors import message, wrong_values


class Section(BaseModel):
    """One table of the recipe: immutable; it refuses unknown names, text in place of numbers, NaN and infinity."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, revalidate_instances="always"
    )

    if not TYPE_CHECKING:

        def __init__(self, **values: Any) -> None:
            """Check all values, and raise an ``InputError`` that names every wrong one."""
            try:
                super().__init__(**values)
            except ValidationError as error:
                raise InputError(message(type(self).__name__, wrong_values(type(self), error))) from None

        # This lets pydantic build nested sections without this __init__, so that the outermost one sees all errors.
        __init__.__pydantic_base_init__ = True

        @classmethod
        def model_validate(cls, obj: Any, **_: Any) -> Self:
            """Make a section from a table of values, with this package's own errors."""
            if isinstance(obj, cls):
                return obj
            if not isinstance(obj, Mapping):
                raise InputError(f"obj: expected a table of settings, but got {of_type(obj)}")
            return cls(**obj)

        @classmethod
        def model_validate_json(cls, json_data: str | bytes, **_: Any) -> Self:
            """Make a section from a table of values in JSON, with this package's own errors."""
            try:
                values = json.loads(json_data)
            except (ValueError, TypeError) as error:
                raise InputError(f"json_data: not JSON: {error}") from None
            return cls.model_validate(values)

        def __setattr__(self, name: str, value: Any) -> None:
            raise InputError(f"{name}: a recipe does not change; make another by model_copy(update={{...}})")

        def __delattr__(self, name: str) -> None:
            self.__setattr__(name, None)

    RETIRED: ClassVar[tuple[str, ...]] = ()
    """Settings of earlier versions, which are read as before and do nothing."""

    @model_validator(mode="before")
    @classmethod
    def _without_retired(cls, values: Any) -> Any:
        return {k: v for k, v in values.items() if k not in cls.RETIRED} if isinstance(values, Mapping) else values

    @field_validator("*", mode="before")
    @classmethod
    def _plain_numbers(cls, value: Any) -> Any:
        """Convert NumPy's scalars to plain numbers."""
        return value.item() if hasattr(value, "dtype") and getattr(value, "ndim", None) == 0 else value

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Return a copy with other values, checked like new ones.

        Parameters
        ----------
        update
            New values by name. For a section, give a section, or a mapping of the values that change in it.
        deep
            As in pydantic; it makes no difference, because nothing here is mutable.

        Raises
        ------
        InputError
            If a value is wrong.

        Examples
        --------
        >>> from debulk.recipe import Recipe
        >>> Recipe().model_copy(update={"material": {"thickness_mm": 0.2}}).material.thickness_mm
        0.2
        """
        if not update:
            return super().model_copy(deep=deep)
        if not isinstance(update, Mapping):
            raise InputError(f"update: expected a table of settings, but got {of_type(update)}")
        values: dict[str, Any] = {name: getattr(self, name) for name in type(self).model_fields}
        for name, value in update.items():
            old = values.get(name)
            values[name] = (
                {**old.model_dump(), **value} if isinstance(old, BaseModel) and isinstance(value, Mapping) else value
            )
        return type(self)(**values)
