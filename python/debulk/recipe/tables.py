"""The tables of a recipe: each setting with its default, its bounds, and a line on what it does."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from debulk import _core
from debulk.recipe.section import Section

# Most defaults come from the compiled modules' options, so that each is written only once, in C++. Defaults that the
# recipe chooses differently are written in its tables below.
_FRONT, _SEGMENT, _FEET = _core.surface.FrontEndOptions(), _core.pocket.SegmentOptions(), _core.pocket.FootOptions()
_NET, _PLY, _MINIMISE = _core.net.LayPocketOptions(), _core.sheet.PlyMaterial(), _core.sheet.MinimiseOptions()
_CRITERIA = _core.verdict.Criteria()

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
UpTo10 = Annotated[float, Field(ge=0, le=10)]
UpTo100 = Annotated[float, Field(ge=0, le=100)]
UpTo1000 = Annotated[float, Field(ge=0, le=1000)]
Limit = Annotated[float, Field(gt=0, le=10)]  # as the thickness: 600 is a limit in micrometres, and passes everything


class Material(Section):
    """The ply: one layer of uncured prepreg."""

    thickness_mm: float = Field(  # in metres or micrometres it would be outside
        default=_PLY.thickness_mm, ge=0.01, le=10, description="thickness t of the uncured ply"
    )
    young_mpa: Positive = Field(default=_PLY.young_mpa, description="modulus E that bends the ply, along both fibres")
    shear_mpa: Positive = Field(default=_PLY.shear_mpa, description="in-plane shear modulus G")
    density_kg_m3: Positive = Field(default=_PLY.density_kg_m3, description="density of the uncured ply")
    friction: UpTo10 = Field(default=_PLY.friction, description="friction coefficient of the ply on what lies below it")
    bulk_factor: float = Field(
        default=_core.ridge.RidgeOptions().bulk_factor,
        ge=1,
        le=5,
        description="thickness before over thickness after debulking",
    )
    locking_deg: float = Field(
        default=45.0,
        gt=0,
        lt=90,
        description="shear from which the ply locks: it buckles rather than shear on (provisional)",
    )
    torsion_n_mm: UpTo1000 = Field(
        default=_PLY.torsion_n_mm,
        description="torsional stiffness of the tows over the ply's width, for the nets (docs/model.md, 3.1); 0: none",
    )
    in_plane_bending_n_mm: UpTo1000 = Field(
        default=_PLY.in_plane_bending_n_mm,
        description="stiffness of the tows against bending within the ply, over its width, for the nets; 0: none",
    )
    tack_n_mm3: UpTo100 = Field(
        default=_PLY.tack_n_mm3,
        description="stiffness of the resin that holds the nets down where the ply lies on the mold; 0: none",
    )

    @property
    def consolidated_mm(self) -> float:
        """Thickness of the debulked ply: as high stands one without any wrinkle."""
        return self.thickness_mm / self.bulk_factor


class Loads(Section):
    """What presses the ply down."""

    pressure_mpa: float = Field(default=_PLY.pressure_mpa, gt=0, le=10, description="vacuum pressure P")
    gravity_m_s2: UpTo100 = Field(default=_PLY.gravity_m_s2, description="acceleration of gravity")
    pressure_direction: Literal["vertical", "normal"] = Field(
        default=_PLY.pressure_direction,  # type: ignore[arg-type]
        description='how the vacuum acts on the nets; "vertical": along -z, whatever the ply does; "normal": along the '
        "normal of the ply, on the cells of the net",
    )
    lumping: Literal["consistent", "paper"] = Field(
        default=_PLY.lumping,  # type: ignore[arg-type]
        description='how loads are shared out to the nodes; "consistent": by the cells of the net, friction out to '
        'the ply\'s edge; "paper": by the area inside the perimeter over all nodes, which depends on the spacing',
    )


class Segmentation(Section):
    """Which regions of the height map count as pockets."""

    cut_height_mm: Positive = Field(
        default=_SEGMENT.cut_height_mm, description="a pocket is where the ply stands higher than this"
    )
    area_tol_mm2: NotNegative = Field(default=_SEGMENT.area_tol_mm2, description="smaller pockets are dropped")
    peak_tol_mm: UpTo100 = Field(
        default=_SEGMENT.peak_tol_mm, description="pockets with a lower peak, above the cut height, are dropped"
    )
    RETIRED = ("regions",)


class Clean(Section):
    """How the scan is cleaned and gridded."""

    neighbours: int = Field(
        default=_FRONT.outliers.neighbours,
        ge=1,
        le=64,
        description="neighbours that decide whether a point is an outlier",
    )
    std_ratio: NotNegative = Field(
        default=_FRONT.outliers.std_ratio,
        description="a point is an outlier if its mean distance to them exceeds the mean of all by this many "
        "deviations",
    )
    least_ratio: UpTo100 = Field(
        default=2.0,
        description="and if it exceeds this many means, which spares the flanks of pockets in a clean scan; 0: the "
        "paper's rule",
    )
    spike_mm: NotNegative = Field(
        default=0.5,
        description="a cell farther than this from the median of the cells two away takes that median; 0: none does",
    )
    median_cells: Literal[1, 3, 5] = Field(default=3, description="width of the median filter: 1 (none), 3 or 5 cells")
    grid_spacing_mm: float | None = Field(
        default=None,
        gt=0,
        le=50,
        description="spacing of the height map; unset: the median distance of the reference's points, at least 0.5 mm",
    )
    max_hole_mm: NotNegative = Field(
        default=_FRONT.hole_diameter_mm, description="drop-outs up to this width are filled from their rim"
    )
    fine_mm: float = Field(
        default=0.5,
        gt=0,
        le=2,
        description="points farther apart than this must not share noise: else the scan was smoothed, and passes "
        "nothing",
    )


class Level(Section):
    """How near to its thickness above the reference the ply must lie between the pockets."""

    tol_mm: float = Field(
        default=0.1,
        gt=0,
        le=10,
        description="the ply lies wrong if it is farther off its thickness than this, or than 0.35 thicknesses",
    )
    largest_share: float = Field(
        default=0.05, ge=0, le=0.5, description="share of the ply between the pockets that may lie wrong"
    )
    largest_edge_share: Share = Field(
        default=0.2,
        description="share of the outline along which the scan may show the ply's edge elsewhere; it may never be 20 "
        "mm away along 120 mm",
    )
    RETIRED = ("remove_offset_mm", "largest_pocket_share")


class Patch(Section):
    """The surface on which the net is laid."""

    mode: Literal["foot", "paper"] = Field(
        default="foot", description='"foot": net down to where the ply meets the mold; "paper": glued at the cut height'
    )
    mold_tol_mm: Positive = Field(
        default=_FEET.mold_tol_mm, description="nearer to the mold than this, the ply touches it"
    )
    smooth_mm: UpTo100 = Field(
        default=_FEET.smooth_mm,
        description="width over which the ply is smoothed before nets and measuring, so that noise is no length",
    )


class Net(Section):
    """The pin-jointed net that stands for the ply."""

    node_target: int = Field(
        default=_NET.net.node_target,
        ge=20,  # with 16 nodes, a third of 51 pockets had more lengths than free coordinates; with 20, none had
        le=5000,
        description="number of nodes of a pocket's net, which sets the spacing; more lower the RMS: part of the "
        "criterion (bench/study)",
    )
    spacing_mm: float | None = Field(
        default=None, ge=0.1, le=1000, description="one spacing for all nets, in place of node_target; unset: none"
    )
    free_edge_mm: UpTo1000 = Field(
        default=_NET.net.free_edge_mm, description="boundary nodes nearer than this to the ply's edge may slide"
    )
    paths: Literal["geodesic", "vertical_plane", "least_shear"] = Field(
        default="geodesic",
        description="initial fibre paths: geodesics of the surface, cuts by a vertical plane, or strips of least shear",
    )


class Solve(Section):
    """How the minimum of the energy is found."""

    when: Literal["needed", "always"] = Field(
        default="needed",
        description='"needed": a pocket that the excess decides gets its net and its minimum when somebody looks at it '
        'or saves it, see report.settle(); "always": within the inspection',
    )
    method: Literal["auto", "interior_point", "ipopt", "nlopt"] = Field(
        default="auto", description="how the minimum is found; debulk.solve.methods() lists what is built"
    )
    starts: int = Field(
        default=2,
        ge=1,
        le=1000,
        description="starting points of every pocket: the net as laid, and seeded perturbations of it",
    )
    most_starts: int = Field(
        default=8,
        ge=1,
        le=1000,
        description="most starts of a pocket: it gets further ones, one by one, while its verdict may still change",
    )
    close_ridge_mm: NotNegative = Field(
        default=0.2,
        description="the verdict may still change where a start ends with a ridge or bridge nearer to the limit than "
        "this",
    )
    close_rms_mm: NotNegative = Field(
        default=0.03,
        description="the same for an RMS; with both, as good as 6 starts for all, in half the time (bench/study)",
    )
    seed: int = Field(default=_MINIMISE.seed, ge=0, lt=2**63, description="seed of the perturbations")
    tolerance: float = Field(
        default=_MINIMISE.solve.tolerance,
        gt=0,
        le=1e-3,
        description="largest error of the scaled first-order conditions; slower above 1e-6, pockets fail above 1e-5 "
        "(bench/study)",
    )
    max_iterations: int = Field(
        default=_MINIMISE.solve.max_iterations,
        ge=1,
        le=1_000_000,
        description="iterations after which a solve gives up",
    )
    stiffness: float = Field(
        default=_MINIMISE.solve.stiffness,
        ge=1e3,
        le=1e12,
        description="1/compliance of the fibres, in scaled units; 1e6 to 1e10 give the same results (bench/study)",
    )


class Ridge(Section):
    """How a ridge's cross-section is read from the net."""

    touch_mm: float | None = Field(
        default=None, gt=0, le=1, description="a node nearer to the mold than this touches it; unset: thickness / 30"
    )


class VerdictLimits(Section):
    """The criteria a pocket must meet to pass."""

    criterion: Literal["excess", "paper"] = Field(
        default=_CRITERIA.criterion.name.lower(),  # type: ignore[arg-type]
        description='what decides a pocket inside the ply; "excess": the ridge that its fibres\' excess makes; '
        '"paper": RMS and ridges of the minima, as at the ply\'s edge',
    )
    max_rms_mm: Limit = Field(
        default=_CRITERIA.max_rms_mm,
        description="largest RMS of the debulked gaps inside the outline; unset: 0.3, or a thicker ply's thickness",
    )
    max_ridge_mm: Limit = Field(
        default=_CRITERIA.max_ridge_height_mm, description="largest height of a ridge or a bridge (provisional)"
    )
    min_coverage: Share = Field(
        default=_CRITERIA.min_coverage, description="least share of the ply that the scan must show"
    )
    min_pocket_coverage: Share = Field(
        default=_CRITERIA.min_pocket_coverage, description="least share of a pocket's own area that the scan must show"
    )
    rms_margin_mm: UpTo1000 = Field(
        default=_CRITERIA.rms_margin_mm,
        description="an RMS nearer to its limit than this decides nothing: other starts move it about as much "
        "(bench/study)",
    )
    ridge_margin_mm: UpTo1000 = Field(
        default=_CRITERIA.ridge_margin_mm,
        description="a ridge or bridge of a minimum nearer to its limit than this decides nothing",
    )
    compliance_margin_mm: UpTo1000 = Field(
        default=_CRITERIA.compliance_margin_mm,
        description="least margin of any figure where fibres needed a compliance",
    )

    max_turn_deg: float = Field(
        default=3.0,
        gt=0,
        le=45,
        description="largest median angle between measured fibres and nominal ones (nominal_angles_deg); beyond it the "
        "ply was laid wrong",
    )
    max_risk: float | None = Field(
        default=0.025,
        gt=0,
        lt=1,
        description="largest probability that a layup is CEASE although a ridge exceeds the limit "
        '(docs/probability.md); beyond it the layup is UNDECIDED; None ("none" in TOML): the ranges alone decide',
    )
    RETIRED = ("excess_margin_mm",)

    @field_validator("max_risk", mode="before")
    @classmethod
    def _of_text(cls, value: Any) -> Any:
        return None if isinstance(value, str) and value == "none" else value


class Uncertainty(Section):
    """What is not known of the ply and of the limit; it enters the probabilities alone."""

    thickness_share: Share = Field(
        default=0.05, description="the thickness lies within this share of its nominal value, evenly"
    )
    height_share: Share = Field(default=0.01, description="heights of the scan are right within this share, evenly")
    angle_deg: float = Field(
        default=2.0, ge=0, le=45, description="the fibres run within this angle of where they are said to, evenly"
    )
    crease_mm: float | None = Field(
        default=None,
        gt=0,
        le=10,
        description="ridge at which half of the pockets crease (debulk calibrate); unset: verdict.max_ridge_mm",
    )
    limit_mm: UpTo10 = Field(
        default=0.0, description="standard deviation of that ridge, as it is known (debulk calibrate)"
    )
    spread_mm: UpTo10 = Field(
        default=0.0, description="standard deviation of it from pocket to pocket (debulk calibrate)"
    )


class Run(Section):
    """How the machine is used."""

    threads: int = Field(
        default=0, ge=0, le=4096, description="worker threads; 0: one per core. The result does not depend on it"
    )
    hash_scan: Literal["xxh3", "sha256", True, False] = Field(
        default="xxh3",
        description="the fingerprint of scan and reference in the report, computed beside the inspection. xxh3: tells "
        "another cloud from this one (0.05 s of one core per GB); sha256: a forged one, too (0.6 s); true: sha256; "
        "false: none",
    )

    @property
    def scan_hash(self) -> Literal["xxh3", "sha256"] | None:
        """The fingerprint that `hash_scan` asks for."""
        if self.hash_scan == "xxh3":
            return "xxh3"
        return "sha256" if self.hash_scan else None

    audit: Share = Field(
        default=0.0,
        description="share of the pockets decided without a net for which one is made, too, to see that it does not "
        "contradict",
    )
    RETIRED = ("dump_folder", "slow_ms")
