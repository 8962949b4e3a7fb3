"""What a command is given: the options that several commands have, and those that are several numbers in one word."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer

from debulk import InputError
from debulk.cli.support import POSE_HELP

RecipeFile = Annotated[Path | None, typer.Option(help="Settings; `debulk recipe` prints an example.")]
Pose = Annotated[Path | None, typer.Option(help=POSE_HELP)]
Outline = Annotated[Path | None, typer.Option(help="The ply's outline in the mold frame, CSV x,y or DXF.")]
Angles = Annotated[str, typer.Option(help="Fibre angles in degrees from the mold's +x.")]
Camera = Annotated[
    str | None, typer.Option(help="f,cx,cy in pixels of an organised cloud; unset: fitted to the reference.")
]
Mask = Annotated[
    Path | None,
    typer.Option(help=".png or .npy as large as the scan's image; not black: a clamp or tool hides the ply."),
]
Unit = Annotated[Literal["mm", "m"], typer.Option(help="Unit of all files.")]
ChainFile = Annotated[Path | None, typer.Option(help="The qualified chain, .json (debulk qualify).")]
Approved = Annotated[Path | None, typer.Option(help="Approved recipes, .toml: with another recipe no layup is CEASE.")]


def angles_of(text: str) -> tuple[float, float]:
    """Read the option --angles."""
    first, second = numbers_of(text, "--angles", "two numbers like 0,90", 2)
    from debulk.inspection.ply.fibre_angles import check_apart

    check_apart((first, second), "--angles")
    return first, second


def camera_of(text: str | None) -> tuple[float, float, float] | None:
    """Read the option --camera."""
    if text is None:
        return None
    expected = "f,cx,cy in pixels like 5200,2560,1920, f positive"
    f, cx, cy = numbers_of(text, "--camera", expected, 3)
    if not (f > 0 and math.isfinite(f + cx + cy)):
        raise InputError(f"--camera: expected {expected}, got {text!r}")
    return f, cx, cy


def numbers_of(text: str, option: str, expected: str, count: int) -> tuple[float, ...]:
    """Read so many numbers, separated by commas."""
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != count:
        raise InputError(f"{option}: expected {expected}, got {text!r}")
    return numbers
