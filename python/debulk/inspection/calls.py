"""An inspection and a comparison in one call each, for a reference that is used only once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from debulk.arguments import typed
from debulk.comparison import Comparison
from debulk.inspection.inspector import Inspector, Progress
from debulk.inspection.ply.fibre_angles import Angles
from debulk.recipe import Recipe
from debulk.report import Report

if TYPE_CHECKING:
    from debulk.chain.record import Chain


@typed
def inspect(
    scan: ArrayLike,
    reference: ArrayLike,
    recipe: Recipe | None = None,
    ply_outline: ArrayLike | None = None,
    fibre_angles_deg: Angles = (0.0, 90.0),
    mold_from_scanner: ArrayLike | None = None,
    camera: tuple[float, float, float] | None = None,
    mask: ArrayLike | None = None,
    deadline_s: float | None = None,
    progress: Progress | None = None,
    context: Mapping[str, Any] | None = None,
    *,
    nominal_angles_deg: Angles | None = None,
    chain: Chain | None = None,
) -> Report:
    """Inspect one scan against a reference, in one call; see `Inspector` and `Inspector.inspect` for the arguments.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> report = inspect(layup.scan, layup.reference, None, layup.ply_outline, (0, 90), layup.mold_from_scanner)
    >>> report.passed
    False
    """
    given = (recipe, reference, ply_outline, fibre_angles_deg, mold_from_scanner, camera, mask)
    inspector = Inspector(*given, nominal_angles_deg=nominal_angles_deg, chain=chain)
    return inspector.inspect(scan, deadline_s, progress, context)


@typed
def compare(
    report: Report,
    debulked_scan: ArrayLike,
    reference: ArrayLike,
    recipe: Recipe | None = None,
    mold_from_scanner: ArrayLike | None = None,
    mask: ArrayLike | None = None,
) -> Comparison:
    """Compare a report with a scan of the same ply after debulking.

    Parameters
    ----------
    report
        The report of the inspection before debulking, from memory or `Report.load`.
    debulked_scan, reference
        (H, W, 3) organised or (N, 3) clouds, mm, NaN = nothing seen: the ply after debulking, and the surface below it.
    recipe
        All settings. None means those of the report.
    mold_from_scanner
        (4, 4), x_mold = T x_scanner, for both clouds; None means that they are in the mold's frame already. The
        outlines of the report are in the mold's frame, so the mold must not have moved within that frame.
    mask
        (H, W) bool, True where the image of either cloud shows a clamp or a tool.

    Returns
    -------
    Comparison
        Measured RMS inside the original outlines, peak in the pockets' feet, outcomes, the hit rate with its confidence
        interval, and ridges that stand beside all pockets.

    Raises
    ------
    InputError
        Names what was wrong, what was expected and what was given.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> pose = layup.mold_from_scanner
    >>> report = debulk.inspect(layup.scan, layup.reference, ply_outline=layup.ply_outline, mold_from_scanner=pose)
    >>> comparison = compare(report, layup.debulked().scan, layup.reference, mold_from_scanner=pose)
    >>> comparison.pockets[0].measured_rms_mm < 0.3
    True
    """
    if recipe is None and report.recipe:
        recipe = Recipe(**report.recipe)
    return Inspector(recipe, reference, mold_from_scanner=mold_from_scanner, mask=mask).compare(report, debulked_scan)
