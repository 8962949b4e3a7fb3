"""What a command is given: the options that several commands have, and those that are several numbers in one word."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from debulk import InputError
from debulk.cli.support import POSE_HELP, pose_of

if TYPE_CHECKING:
    from debulk.net import Draping

RecipeFile = Annotated[Path | None, typer.Option(help="Settings; `debulk recipe` prints an example.")]
Pose = Annotated[Path | None, typer.Option(help=POSE_HELP)]
Mask = Annotated[
    Path | None,
    typer.Option(help=".png or .npy as large as the scan's image; not black: a clamp or tool hides the ply."),
]
Unit = Annotated[Literal["mm", "m"], typer.Option(help="Unit of all files.")]
FrameUnit = Annotated[
    Literal["mm", "m"] | None, typer.Option(help="Unit of pose, outline and measured angles; unset: that of --unit.")
]
OutlineLayer = Annotated[
    str | None, typer.Option(help="Layer of a DXF on which the outline is, or layers: 1,11 if cut-outs have their own.")
]
ChainFile = Annotated[Path | None, typer.Option(help="The qualified chain, .json (debulk qualify).")]
Approved = Annotated[Path | None, typer.Option(help="Approved recipes, .toml: with another recipe no layup is CEASE.")]


Outputs = Annotated[list[Path] | None, typer.Option("-o", "--output", help=".html, .json or .csv; repeatable.")]


@dataclass(frozen=True)
class Given:
    """What an inspector is made from, besides its reference."""

    recipe: RecipeFile = None
    pose: Pose = None
    outline: Annotated[Path | None, typer.Option(help="The ply's outline in the mold frame, CSV x,y or DXF.")] = None
    outline_layer: OutlineLayer = None
    angles: Annotated[
        str,
        typer.Option(
            help="Fibre angles in degrees from the mold's +x, everywhere; or, as 0,90@X,Y, at the place in mm where "
            "the ply was first laid down, from which it is draped over the reference."
        ),
    ] = "0,90"
    camera: Annotated[
        str | None, typer.Option(help="f,cx,cy in pixels of an organised cloud; unset: fitted to the reference.")
    ] = None
    mask: Mask = None
    unit: Unit = "mm"
    frame_unit: FrameUnit = None

    @property
    def in_frame(self) -> Literal["mm", "m"]:
        """Unit of what is given in the mold frame."""
        return self.frame_unit or self.unit

    def read(self) -> dict[str, Any]:
        """Read it: the arguments of a `debulk.Inspector` by their names."""
        angles, camera = self._angles(), self._camera()

        from debulk import files
        from debulk.recipe import Recipe

        return {
            "recipe": Recipe() if self.recipe is None else Recipe.load(self.recipe),
            "ply_outline": self.outline and files.load_outline(self.outline, self.in_frame, self.outline_layer),
            "fibre_angles_deg": angles,
            "mold_from_scanner": pose_of(self.pose, self.in_frame),
            "camera": camera,
            "mask": None if self.mask is None else files.load_mask(self.mask),
        }

    def _angles(self) -> tuple[float, float] | Draping:
        given, expected = self.angles, "two numbers like 0,90, or with a place like 0,90@100,50"
        first, second, *seed = numbers_of(given.replace("@", ",", 1), "--angles", expected, 4 if "@" in given else 2)
        from debulk.inspection.ply.fibre_angles import check_apart

        check_apart((first, second), "--angles")
        if not seed:
            return first, second
        from debulk.net import Draping

        return Draping((seed[0], seed[1]), (first, second))

    def _camera(self) -> tuple[float, float, float] | None:
        if self.camera is None:
            return None
        expected = "f,cx,cy in pixels like 5200,2560,1920, f positive"
        f, cx, cy = numbers_of(self.camera, "--camera", expected, 3)
        if not (f > 0 and math.isfinite(f + cx + cy)):
            raise InputError(f"--camera: expected {expected}, got {self.camera!r}")
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


def size_of(text: str, option: str, expected: str) -> tuple[int, int]:
    """Read two whole numbers with an x between them."""
    first, _, second = text.partition("x")
    if not (first.isdecimal() and second.isdecimal() and len(text) < 12):
        raise InputError(f"{option}: expected {expected}, got {text!r}")
    return int(first), int(second)
