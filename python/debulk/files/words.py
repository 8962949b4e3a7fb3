"""The words of a line of text: how they are separated, which are numbers, and which stand for nothing seen."""

from __future__ import annotations

import csv
import re

SEPARATORS = (";", "\t", "|", ",", " ")
"""The most telling one comes first: a comma may also be a decimal sign, and a blank may stand beside any other."""

# The missing values 1.#QNAN, 1,#QNAN and #N/A start no comment.
_COMMENT = re.compile(r"(?<!\d\.)(?!(?<=\d,)#(?:QNAN|SNAN|IND|INF))#(?!N/A)|//")
_VALUE = re.compile(
    r"[+-]?(?=[.,]?\d)[\d.,]+([eE][+-]?\d+)?|[+-]?(nan(\(\w*\))?|inf(inity)?|1[.,]#(qnan|snan|ind|inf)0*)"
    r"|#?n/a|na|null|none|-+",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMMA_NUMBER = re.compile(r"[+-]?(\d+,\d*|,\d+)([eE][+-]?\d+)?")


def without_comment(text: str) -> str:
    """Return what stands before a comment."""
    return _COMMENT.split(text, maxsplit=1)[0].strip(" \r\n")


def split(text: str, separator: str) -> list[str]:
    """Return the columns of a line without their quotes; a blank separator stands for any number of blanks."""
    if '"' in text:
        if separator == " ":
            return [word.strip('" ') for word in re.findall(r'"[^"]*"|\S+', text)]
        try:
            return [word.strip() for word in next(csv.reader([text], delimiter=separator, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            pass
    return text.split() if separator == " " else [word.strip() for word in text.split(separator)]


def is_value(word: str) -> bool:
    """Tell whether a word is meant as a number, of either decimal sign, or as a missing one."""
    return _VALUE.fullmatch(word) is not None


def is_number(word: str) -> bool:
    """Tell whether a word is a finite number with a decimal point, or a whole one."""
    return _NUMBER.fullmatch(word) is not None


def is_comma_number(word: str) -> bool:
    """Tell whether a word is a number with a decimal comma."""
    return _COMMA_NUMBER.fullmatch(word) is not None
