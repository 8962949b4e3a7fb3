"""The commands of the scanner: ``debulk scan LEFT RIGHT``, and after ``scan`` patterns, calibrate, projector."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
import typer
from numpy.typing import NDArray
from typer.core import TyperGroup

from debulk import InputError
from debulk.cli.command import command
from debulk.cli.examples import epilog
from debulk.cli.given import size_of
from debulk.cli.pairing import paired
from debulk.cli.support import Progress, check_output, make_folder, shown_progress, written
from debulk.files.replacing import write_picture

if TYPE_CHECKING:
    from debulk.scanner import Scan
    from debulk.scenes import Layup

_IMAGES = (".png", ".tif", ".tiff", ".bmp", ".pgm")
_CLOUDS = (".npy", ".npz", ".ply", ".pcd")

PERIODS = Annotated[str, typer.Option(help="Numbers of fringes over the projector's width.")]
STEPS = Annotated[int, typer.Option(min=3, help="Images of each number of periods.")]


class _ScanGroup(TyperGroup):
    """`debulk scan LEFT RIGHT` scans; a first word that names another command is that command."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] != "--help":
            args = ["images", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_ScanGroup,
    no_args_is_help=True,
    help="From the fringe images of two cameras to a cloud: debulk scan LEFT RIGHT --calibration c.json -o scan.pcd.",
    epilog=epilog("scan"),
)


@command(app, "scan images")
def images(
    left: Annotated[Path, typer.Argument(help="Folder with the left camera's images, in the order of their names.")],
    right: Annotated[Path, typer.Argument(help="Likewise, of the right camera.")],
    calibration: Annotated[Path, typer.Option(help="From `debulk scan calibrate`.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Cloud: .pcd, .ply, .npy or .npz.")],
    picture: Annotated[
        Path | None, typer.Option(help=".png of modulation, exposure, order residual and depth.")
    ] = None,
    periods: PERIODS = "50,51",
    steps: STEPS = 6,
    bits: Annotated[int | None, typer.Option(help="Of the sensor; unset: 8, or 12 in 16.")] = None,
    deadline: Annotated[float | None, typer.Option(help="Seconds after which the scan ends.")] = None,
) -> None:
    """Scan (the word `images` may be left out): decode both cameras' images and triangulate.

    Several exposures: a subfolder for each, shortest first by name, or all in one folder, exposure by exposure.
    """
    numbers = _numbers(periods)
    check_output(output, *_CLOUDS)
    check_output(picture, ".png")
    from debulk import scanner
    from debulk.files import save_cloud
    from debulk.scanner.picture import picture as drawn

    cameras = scanner.Calibration.load(calibration)
    count = steps * len(numbers)
    with shown_progress() as progress:
        progress("reading", 0.0)
        left_images = _stack(left, count)
        progress("reading", 0.5)
        right_images = _stack(right, count)
        instrument = scanner.Scanner(cameras, numbers, steps, bits=bits, details=picture is not None)
        scan = instrument.scan(left_images, right_images, deadline, progress)
        save_cloud(output, scan.points_mm)
    if picture is not None and instrument.left is not None:
        write_picture(picture, drawn(scan, instrument.left))
    print(summary(scan))
    written(output, picture)


@command(app, "scan patterns")
def patterns(
    folder: Annotated[Path, typer.Argument(help="For the images, made if need be.")],
    pixels: Annotated[str, typer.Option(help="Width x height of the projector.")] = "1920x1080",
    periods: PERIODS = "50,51",
    steps: STEPS = 6,
    direction: Annotated[Literal["vertical", "horizontal", "both"], typer.Option(help="Of the fringes.")] = "vertical",
) -> None:
    """Write the patterns that the projector shows, numbered in their order."""
    from debulk.scanner import fringe_patterns

    width, height = size_of(pixels, "--pixels", "WIDTHxHEIGHT like 1920x1080")
    made = fringe_patterns((width, height), _numbers(periods), steps, direction)
    make_folder(folder)
    for k, pattern in enumerate(made, start=1):
        write_picture(folder / f"pattern_{k:02d}.png", pattern)
    print(f"written: {len(made)} patterns of {width} x {height} pixels in {folder}")


@command(app, "scan calibrate")
def calibrate(
    left: Annotated[Path, typer.Argument(help="Folder with the left camera's images of the board.")],
    right: Annotated[Path, typer.Argument(help="The right camera's, with the same numbers in their names.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration, .json.")],
    squares: Annotated[str, typer.Option(help="Squares across x down, the outermost included.")],
    square_mm: Annotated[float, typer.Option("--square-mm", help="Side of a square, mm, as measured.")],
    charuco: Annotated[bool, typer.Option("--charuco", help="A ChArUco board, not a checkerboard.")] = False,
    marker_mm: Annotated[float | None, typer.Option("--marker-mm", help="Side of a ChArUco marker, mm.")] = None,
    dictionary: Annotated[str, typer.Option(help="Of the ChArUco markers, by OpenCV's name.")] = "DICT_5X5_250",
    distance_mm: Annotated[
        float | None, typer.Option("--distance-mm", help="Of what is scanned later, mm; unset: that of the boards.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help=".png of where the boards were, written also if there are too few.")
    ] = None,
) -> None:
    """Calibrate both cameras from images of a board, and say how certain heights will be.

    Images are paired by the numbers in their names. Pairs that spoil the fit, repeat another or do not show the board
    are named.
    """
    check_output(output, ".json")
    check_output(picture, ".png")
    counts = size_of(squares, "--squares", "ACROSSxDOWN like 10x7")
    from debulk import scanner

    board = scanner.Board(counts, square_mm, "charuco" if charuco else "checkerboard", marker_mm, dictionary)
    pairs, alone = paired(_files(left), _files(right))
    for name, why in alone.items():
        print(f"left out: {name}: {why}")
    left_seen, right_seen = ([_eight_bits(_read(path)) for path in side] for side in zip(*pairs, strict=True))
    names = [one.name for one, _ in pairs]
    try:
        found = scanner.calibrate(left_seen, right_seen, board, names=names, distance_mm=distance_mm)
    except scanner.UncertainCalibration as refused:
        for name, why in refused.calibration.spoiling.items():
            print(f"left out: {name}: {why}")
        if picture is not None:
            write_picture(picture, scanner.calibration_picture(refused.calibration))
            written(picture)
        raise
    found.save(output)
    for name, error in sorted(found.image_errors_px.items(), key=lambda item: -item[1]):
        print(f"{name}: {error:.3f} px")
    print(found.text())
    if picture is not None:
        write_picture(picture, scanner.calibration_picture(found))
    written(output, picture)


@command(app, "scan projector")
def projector(
    left: Annotated[Path, typer.Argument(help="Folder with the left camera's images of a surface with relief.")],
    right: Annotated[Path, typer.Argument(help="Likewise, of the right camera.")],
    calibration: Annotated[Path, typer.Option(help="From `debulk scan calibrate`.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Calibration with the projector, .json.")],
    periods: PERIODS = "50,51",
    steps: STEPS = 6,
    bits: Annotated[int | None, typer.Option(help="Of the sensor; unset: 8, or 12 in 16.")] = None,
) -> None:
    """Learn the projector right after `calibrate`: later scans then tell when a camera was turned."""
    check_output(output, ".json")
    from debulk import scanner

    numbers = _numbers(periods)
    count = steps * len(numbers)
    cameras = scanner.Calibration.load(calibration)
    views = [(_stack(left, count), _stack(right, count))]
    found = scanner.calibrate_projector(cameras, views, numbers, steps, bits=bits)
    found.save(output)
    if found.projector is not None:
        print(f"depths by projector and cameras differ by {found.projector.error_mm:.2f} mm, their noise included")
    written(output)


def scanned(layup: Layup, pixels: tuple[int, int], progress: Progress) -> Layup:
    """Scan ply and bare mold with the virtual scanner, and put its clouds, pose and camera in place of the layup's."""
    from debulk.scanner import Scanner
    from debulk.scenes import fringe_images

    clouds = []
    for k, name in enumerate(("the bare mold", "the ply")):
        progress(f"images of {name}", 0.1 + 0.5 * k)
        seen = fringe_images(layup, pixels, bare=k == 0)
        progress(f"scanning {name}", 0.4 + 0.5 * k)
        scan = Scanner(seen.calibration).scan(seen.left, seen.right)
        clouds.append(scan.points_mm)
    return dataclasses.replace(
        layup, reference=clouds[0], scan=clouds[1], mold_from_scanner=seen.mold_from_scanner, camera=scan.camera
    )


def summary(scan: Scan) -> str:
    """Say in a few lines what was scanned."""
    counts = scan.counts
    known = np.isfinite(scan.uncertainty_mm)
    lines = [
        f"{counts['matched']} points of {counts['seen']} pixels seen by the left camera; {counts['unmatched']} "
        f"seen by it alone"
    ]
    if known.any():
        lines.append(f"uncertainty {np.median(scan.uncertainty_mm[known]):.3f} mm in the median")
    if scan.epipolar is not None:
        error = scan.epipolar.error_px
        said = (
            f"rows agree within {error:.2f} px"
            if np.isfinite(error)
            else "the surface has too little texture to say whether a camera moved"
        )
        lines.append(said)
    if np.isfinite(scan.projector_mm):
        lines.append(f"cameras and projector agree within {scan.projector_mm:.2f} mm")
    f, cx, cy = scan.camera
    lines.append(f"camera of the cloud (f,cx,cy): {f:.4f},{cx:.4f},{cy:.4f}")
    return "\n".join(lines)


def _numbers(periods: str) -> tuple[int, ...]:
    try:
        return tuple(int(word) for word in periods.split(","))
    except ValueError:
        raise InputError(f"--periods: expected whole numbers like 50,51, got {periods!r}") from None


def _natural(path: Path) -> list[Any]:
    """Sort key by which image 10 comes after image 9."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", path.name.lower())]


def _shown(folder: Path) -> list[Path]:
    """List a folder without what systems put beside the files: hidden ones, thumbnails, archives' leftovers."""
    return [path for path in folder.iterdir() if not path.name.startswith((".", "@", "__MACOSX"))]


def _files(folder: Path) -> list[Path]:
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder with images")
    found = sorted((path for path in _shown(folder) if path.suffix.lower() in _IMAGES), key=_natural)
    if not found:
        raise InputError(f"{folder}: expected images ({', '.join(_IMAGES)}), but there are none")
    return found


def _stack(folder: Path, count: int) -> list[list[NDArray[Any]]]:
    if not folder.is_dir():
        raise InputError(f"{folder}: expected a folder with images")
    exposures = sorted((path for path in _shown(folder) if path.is_dir()), key=_natural)
    groups = [_files(path) for path in exposures]
    if not groups:
        files = _files(folder)
        if len(files) % count:
            raise InputError(f"{folder}: expected {count} images, or that many for each exposure, but got {len(files)}")
        groups = [files[k : k + count] for k in range(0, len(files), count)]
    return [[_read(path) for path in group] for group in groups]


def _read(path: Path) -> NDArray[Any]:
    import cv2

    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: cannot be read as an image")
    from debulk.scanner.inputs import grey_of

    return grey_of(np.asarray(image), str(path))


def _eight_bits(image: NDArray[Any]) -> NDArray[np.uint8]:
    """Scale a 16-bit image by its own white: corners are found by contrast."""
    if image.dtype == np.uint8:
        return image
    return (image.astype(np.float32) * (255.0 / max(1, int(image.max())))).astype(np.uint8)
