"""The 2-D section model: the fold of a ply whose cross-section is longer than the mold below it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.arguments import typed
from debulk.arrays import same_named

_DEFAULTS = _core.section.SectionOptions()  # each default is defined only in cpp/debulk/section/fold.hpp

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["ElasticFold", "Fold", "LoadStep", "elastic_fold", "elastic_height", "fold"]

# The closed form for small excess (docs/model.md, section 6): h / l over (excess / l)^(4/7), foot width / l over
# (excess / l)^(1/7), the end force H / (P l) over (excess / l)^(-2/7), and the largest slope over (excess / l)^(3/7).
# That slope is where cos ks = cos k, k = 4.4934, and is 2 pi P / sqrt(H^3 / c).
_SMALL_HEIGHT, _SMALL_WIDTH, SMALL_FORCE = 1.3256, 4.844, 3.441
_SMALL_SLOPE = 2 * math.pi / SMALL_FORCE**1.5
# By excess / l: height, foot width and largest slope of `fold` (following pressure, consistent bending, a flat mold, a
# span of 14 l; 400 segments for the height, 1000 for the others), divided by those of the closed form. Without the
# thickness, folds of all plies are alike in units of l.
_FOLDED = np.array((
    (0.0, 1.0, 1.0, 1.0), (0.01, 0.99888, 0.9976, 0.9998), (0.03, 0.99747, 0.9932, 0.9997),
    (0.1, 0.99380, 0.9801, 0.9995), (0.2, 0.98888, 0.9639, 0.9992), (0.35, 0.98244, 0.9419, 0.9986),
    (0.5, 0.97624, 0.9213, 0.9981), (0.75, 0.96654, 0.8893, 0.9971), (1.0, 0.95746, 0.8594, 0.9960),
    (1.5, 0.94069, 0.8038, 0.9936), (2.0, 0.92522, 0.7526, 0.9907), (3.0, 0.89771, 0.6605, 0.9838),
    (4.0, 0.87436, 0.5798, 0.9751), (5.0, 0.85507, 0.5093, 0.9649), (5.5, 0.84702, 0.4788, 0.9589),
))  # fmt: skip
_FLANKS_MEET = float(_FOLDED[-1, 0])


@dataclass(frozen=True)
class LoadStep:
    """The fold under a part of the pressure; its figures are NaN if the step has no certified single fold."""

    pressure_mpa: float
    """Pressure of this step, MPa."""
    height_mm: float
    foot_width_mm: float
    end_force_n_per_mm: float
    """`height_mm`, `foot_width_mm`, `end_force_n_per_mm`: as in `Fold`."""
    iterations: int
    """Iterations of the minimiser."""


@dataclass(frozen=True, eq=False)
class Fold:
    """The section of the ply in equilibrium."""

    points_mm: NDArray[np.float64]
    """(segments + 1, 2) nodes (x, z) of the ply's mid-line, mm, with x from the middle of the span. For a fold that is
    not certified they show where the solve ended."""
    height_mm: float
    """Largest distance of the mid-line from the mold, perpendicular to the chord between the pins, mm. It is 0 for a
    ply that lies on the mold, because no thickness is added. NaN unless certified."""
    foot_width_mm: float
    """Distance along the chord between the points where the ply leaves the mold, mm; if all of it is lifted, the
    distance of the pins. NaN unless certified."""
    end_force_n_per_mm: float
    """Thrust on the pins along the chord, N per mm of ridge; friction must hold it for the ply not to slip. NaN unless
    certified."""
    steps: tuple[LoadStep, ...]
    """All load steps tried, in order; the last is the result."""
    certified: bool
    """Whether the solve ended well, the fold keeps the limits of `debulk.solve.Certificate` (length error, penetration,
    residual force, no negative curvature), and it is a single fold: the only kind of success."""
    status: str
    """How the last solve ended: converged, iteration_limit, deadline, cancelled, numerical_failure."""
    explanation: str
    """Why it is not certified, in words."""
    length_error: float
    """Largest relative error of a segment's length."""
    penetration_mm: float
    """Depth of the deepest node below the mold, or of one flank beyond the other, mm."""
    kkt_error: float
    """Largest unbalanced force, in units of the load on a segment. NaN if the solve failed."""
    guide_force_n_per_mm: float
    """Force that keeps the crown in the middle of the span, N/mm: 0, apart from rounding, on a mirror-symmetric
    mold."""
    natural_length_mm: float
    """l = (c / P)^(1/3), where c is the bending stiffness that acts: the length scale of all folds, mm."""


_OF_LAST_STEP = ("height_mm", "foot_width_mm", "end_force_n_per_mm")
_OF_CERTIFICATE = ("length_error", "penetration_mm", "kkt_error")


@typed
def fold(
    excess_length_mm: float,
    span_mm: float,
    recipe: Recipe | None = None,
    segments: int = _DEFAULTS.segments,
    steps: int = _DEFAULTS.steps,
    pressure: Literal["following", "vertical"] = "following",
    bending: Literal["consistent", "paper"] = "consistent",
    self_contact: bool = _DEFAULTS.self_contact,
    profile: ArrayLike | None = None,
    *,
    contact_distance_mm: float | None = None,
    deadline_s: float | None = None,
    stop: _core.Stop | None = None,
) -> Fold:
    """Fold the cross-section of a ply under vacuum.

    An inextensible polyline, pinned on the mold at both ends without moments, bends and is pressed on the mold; there
    is no friction. Several equilibria exist. This is the single upright fold in the middle of the span: through the
    load steps it grows out of one smooth bump there, takes half of the excess from either side, and its crown is kept
    upright on the normal to the chord between the pins. On a flat mold it has the least energy of all: the energy of a
    fold grows as the 5/7th power of its excess, so that two folds of half the excess have 1.2 times as much. Whether it
    would lean over is not examined. If a load step leaves the single fold (a dead load may press in the crown of a wide
    arch), the step is repeated from a bump made for its pressure.

    Parameters
    ----------
    excess_length_mm
        Length of the ply minus that of the mold between the pins, mm; between a thousandth of the natural length and
        the span. Below that, h = 1.3256 l (excess / l)^(4/7) is right.
    span_mm
        Horizontal distance between the pins, mm.
    recipe
        Its `material` (thickness t, modulus E) and `loads.pressure_mpa` are used. Default: ``Recipe()``.
    segments
        Segments of the polyline, an even number, 16 or more; ten or more in the fold. The error falls with the square
        of their length.
    steps
        Number of equal steps in which the pressure grows to its full value.
    pressure
        "following": normal to the ply wherever it moves (it has a potential, the area between ply and mold; the paper
        turns it between load steps). "vertical": a dead load along -z per length of ply, as in `debulk.sheet`.
    bending
        "consistent": c θ²/2 per unit of width and segment length, c = E t³/12. "paper": c θ²/2 per node, as for the
        nodes of a coarse net, not scaled for the short segments, which gives the ply the stiffness 2 c / segments; very
        likely this is what the paper's section has. The two are bounds. With the first, folds are higher and wider than
        the paper's 2 t. With the second, whose answer depends on `segments`, they fit the paper's ridge formula.
    self_contact
        Whether the flanks must not pass through each other.
    profile
        (M, 2) points (x, z) of the mold, mm, with x growing from -span/2 to span/2 or beyond on both sides; a natural
        cubic spline passes through them. None: flat, z = 0.
    contact_distance_mm
        Distance between the mid-lines of flanks that touch, mm; 0: two lines. None: the ply's thickness, so that a
        closed fold is 2 t wide. With it, flanks touch sooner.
    deadline_s
        Seconds until the solve stops with status "deadline".
    stop
        Another thread may cancel the solve with it.

    Returns
    -------
    Fold
        Shape, figures, load steps and certificate. A failure is reported by its status, with NaN figures.

    Raises
    ------
    InputError
        If the excess is not positive or exceeds the span, the span is not positive, there are too few or too many
        segments for the fold, a name is unknown, or the profile is not finite, does not grow in x or does not reach the
        pins.

    Notes
    -----
    Krogh, Jakobsen, Wilm, "Will it Crease or Cease?", section on post-processing the results. For a small excess, the
    elastica under pressure on a rigid floor has closed forms, with which the tests compare.

    Examples
    --------
    As in the paper, three nodes 9.3 mm apart, the middle one 3.2 mm above a flat mold; the paper's formula gives 0.70
    mm:

    >>> half = (9.3**2 - 3.2**2) ** 0.5
    >>> soft = fold(2 * (9.3 - half), 2 * half, bending="paper")
    >>> stiff = fold(2 * (9.3 - half), 2 * half)
    >>> soft.certified, round(soft.height_mm, 2), stiff.certified, round(stiff.height_mm, 2)
    (True, 0.9, True, 1.87)
    >>> [round(step.height_mm, 2) for step in stiff.steps]
    [2.38, 2.15, 2.02, 1.94, 1.87]
    """
    from debulk.recipe import Recipe
    from debulk.recipe.options import section_ply

    recipe = recipe or Recipe()
    if stop is None:
        stop = _core.Stop()
    if deadline_s is not None:
        stop.set_deadline(deadline_s)
    options = _core.section.SectionOptions()
    options.segments = segments
    options.steps = steps
    options.pressure = pressure
    options.bending = bending
    options.self_contact = self_contact
    options.contact_distance_mm = recipe.material.thickness_mm if contact_distance_mm is None else contact_distance_mm
    found = _core.section.fold_section(
        excess_length_mm,
        span_mm,
        section_ply(recipe),
        None if profile is None else np.asarray(profile, dtype=np.float64),
        options,
        stop,
    )
    load_steps = tuple(LoadStep(**same_named(LoadStep, step)) for step in found.steps)
    return Fold(
        **same_named(Fold, found, "steps", *_OF_LAST_STEP, *_OF_CERTIFICATE),
        **{name: getattr(load_steps[-1], name) for name in _OF_LAST_STEP},
        **{name: getattr(found.certificate, name) for name in _OF_CERTIFICATE},
        steps=load_steps,
    )


@dataclass(frozen=True)
class ElasticFold:
    """Dimensions of an elastic fold, seen from the side."""

    height_mm: float
    """Height of its crown above the mold, to the ply's mid-line."""
    foot_width_mm: float
    """Distance between the points where the ply leaves the mold."""
    slope_deg: float
    """Largest angle between ply and mold; above 90 if the flanks overhang."""


@typed
def elastic_fold(excess_length_mm: float, recipe: Recipe | None = None) -> ElasticFold:
    """Return the elastic fold on a flat mold that `fold` finds, from a table: microseconds instead of milliseconds.

    Parameters
    ----------
    excess_length_mm
        Length of the ply minus that of the mold, mm. Above 5.5 natural lengths the flanks touch each other. Any further
        excess raises the fold by half of it, and leaves the foot width and slope unchanged.
    recipe
        Its `material` (thickness, modulus) and `loads.pressure_mpa` are used. Default: ``Recipe()``.

    Returns
    -------
    ElasticFold
        Height within 2 %, foot width within 6 % and slope within 3 % of `fold`; up to 5 natural lengths of excess
        within 0.5, 1.5 and 0.5 %. All are 0 without excess.

    Raises
    ------
    InputError
        If the excess is not finite.

    Examples
    --------
    For the excess at which the formula gives a ridge of 0.60 mm:

    >>> side = elastic_fold(0.94)
    >>> round(side.height_mm, 2), round(side.foot_width_mm, 1), round(side.slope_deg)
    (1.69, 8.1, 41)
    """
    from debulk.recipe import Recipe

    if not math.isfinite(excess_length_mm):
        raise _core.InputError(f"excess_length_mm: expected a length in mm, but got {excess_length_mm}")
    if excess_length_mm <= 0:
        return ElasticFold(0.0, 0.0, 0.0)
    recipe = recipe or Recipe()
    ply = recipe.material
    length_mm = (ply.young_mpa * ply.thickness_mm**3 / 12 / recipe.loads.pressure_mpa) ** (1 / 3)  # (c / P)^(1/3)
    at = min(excess_length_mm / length_mm, _FLANKS_MEET)
    height, width, slope = (float(np.interp(at, _FOLDED[:, 0], ratios)) for ratios in _FOLDED[:, 1:].T)
    return ElasticFold(
        height_mm=_SMALL_HEIGHT * length_mm * at ** (4 / 7) * height + (excess_length_mm - at * length_mm) / 2,
        foot_width_mm=_SMALL_WIDTH * length_mm * at ** (1 / 7) * width,
        slope_deg=math.degrees(_SMALL_SLOPE * at ** (3 / 7) * slope),
    )


@typed
def elastic_height(excess_length_mm: float, recipe: Recipe | None = None) -> float:
    """Height of `elastic_fold`, mm.

    Parameters
    ----------
    excess_length_mm
        Length of the ply minus that of the mold, mm. The height is 0 if this is 0 or negative.
    recipe
        Thickness, modulus and vacuum. Default: ``Recipe()``.

    Raises
    ------
    InputError
        If the excess is not finite.

    Examples
    --------
    >>> round(elastic_height(0.94), 2), round(fold(0.94, 30.0).height_mm, 2)
    (1.69, 1.69)
    """
    return elastic_fold(excess_length_mm, recipe).height_mm
