"""A recipe as commented TOML, generated from the descriptions in the model itself."""

from __future__ import annotations

import json
import textwrap
from typing import Any

from pydantic import BaseModel

_COMMENT_COLUMN = 34
_WIDTH = 120


def toml(recipe: BaseModel) -> str:
    """Return the recipe as TOML, with a comment after every setting."""
    lines = ["# Recipe of debulk. What is left out keeps the value shown by `debulk recipe`."]
    for section_name in type(recipe).model_fields:
        section = getattr(recipe, section_name)
        lines += ["", f"# {(type(section).__doc__ or '').strip()}", f"[{section_name}]"]
        for name, field in type(section).model_fields.items():
            value = getattr(section, name)
            value = "none" if value is None and field.default is not None else value  # left out, it were the default
            setting = f"{name} = {'...' if value is None else _literal(value)}"
            follows = name == "max_rms_mm" and name not in section.model_fields_set  # from the thickness, as it is
            setting = f"# {setting}" if value is None or follows else setting
            comment = textwrap.wrap(field.description or "", _WIDTH - _COMMENT_COLUMN - 2) or [""]
            lines.append(f"{setting:<{_COMMENT_COLUMN}}# {comment[0]}".rstrip())
            lines += [f"{'':<{_COMMENT_COLUMN}}# {rest}" for rest in comment[1:]]
    return "\n".join(lines) + "\n"


def _literal(value: Any) -> str:
    # repr gives the shortest text that reads back to the same double; strings and truth values are as in JSON.
    return json.dumps(value) if isinstance(value, (str, bool)) else repr(value)
