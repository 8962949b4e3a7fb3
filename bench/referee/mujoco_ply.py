"""The referee's external solver: a ply in MuJoCo, pressed on its mold with Coulomb friction, from noisy starts.

Fibres are flexes of dimension 1 (one for each direction, bending as an elastic rod, with lengths held by equality
constraints); a flex of dimension 2 on the same bodies carries the shear. Every node is a body with three slides and a
small sphere that touches the mold. Rim nodes are pinned; those at the ply's edge, or all of them if there is a margin,
slide against the friction of the ply between them and the edge. Units are mm, N, s. The mass is not that of the ply but
one with which it settles in some hundred steps (the state of rest does not depend on it).

A run counts only if it ends with all strains at most 1e-3 and no node in motion. When the dome snaps through, a few
segments are strained more for some steps (the table says how much). Runs at half the speed of the ramp show the effect
of that and of the ramp.

What it took: rods must be given straight bodies (the relaxed lattice) and take their draped shape through `qpos`; with
bodies placed on the draped surface the model never comes to rest. Dry friction of a joint needs `solreffriction` and
`solimpfriction` as hard as the contacts, or the rim creeps in at once. Curved molds are height fields. MuJoCo 4.0.0
warns that the flex that carries the shear "has no passive forces": a net sheared by 0.01 answers with G t A gamma to
1e-4 all the same.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import mujoco
import numpy as np
from pockets import Pocket

from debulk import net
from debulk.pocket import distance_to_outline
from debulk.recipe import Recipe

MOST_STRAIN = 1e-3
MOST_SPEED_MM = 2e-4  # per step, of any node; motion below this is the creep of MuJoCo's softened friction
_FITTING_STEPS = 50  # steps in which the noisy start returns to the fibres' lengths, under little pressure
_STEP_S = 2e-3
_SPHERE_MM = 0.02
_ROD_MM = 0.1  # radius of the fibres' rods, whose modulus is chosen so that they bend like the ply
_IMPEDANCE = 0.9999


@dataclass(frozen=True)
class Physics:
    """The physical parameters that the sensitivity study varies."""

    young_mpa: float = 360.0
    friction: float = 0.4
    following: bool = False  # pressure along the ply's normal instead of -z
    margin_mm: float = 0.0  # width of ply round the pocket that friction alone holds; 0: the rim is pinned
    noise_mm: float = 0.05
    ramp_steps: int = 400
    mass: float = 4e-5  # of a node, N s^2 / mm, at a spacing of 1 mm; grows with the cell


@dataclass(frozen=True, eq=False)
class Settled:
    """The end state of a run."""

    nodes_mm: np.ndarray
    strain: float
    most_strain: float  # largest during the run, after the noisy start has returned to the fibres' lengths
    speed_mm: float  # largest of any node in the last step
    steps: int
    cpu_s: float
    accepted: bool


def simulate(
    pocket: Pocket, laid: net.Net, seed: int, physics: Physics, most_steps: int = 3000, recipe: Recipe | None = None
) -> Settled:
    """Ramp the pressure up and wait until nothing moves; thickness, shear and pressure are the recipe's."""
    recipe = recipe or Recipe()
    flat = float(np.ptp(pocket.mold_mm)) < 1e-9
    start = laid.nodes_mm.copy()
    moves = laid.kinds != 1 if physics.margin_mm == 0 else np.ones(len(start), dtype=bool)
    model = mujoco.MjModel.from_xml_string(_xml(pocket, laid, moves, physics, flat, recipe))
    if not flat:
        _set_mold(model, pocket)
    _set_lengths(model, laid)
    model.body_pos[1 + np.flatnonzero(~moves)] = start[~moves]
    data = mujoco.MjData(model)
    rough = start + 0.0
    rough[moves, 2] += _noise(start[moves, :2], seed, physics.noise_mm)
    rough[:, 2] = np.maximum(rough[:, 2], pocket.reference.height(rough[:, :2]))
    data.qpos[:] = (rough - _relaxed(laid))[moves].ravel()
    model.dof_damping[:] = physics.mass * laid.spacing_mm**2 / (50 * _STEP_S)

    bodies = 1 + np.flatnonzero(moves)
    force = recipe.loads.pressure_mpa * laid.spacing_mm**2
    began, step, speed, most = time.process_time(), 0, np.inf, 0.0
    down = np.array([0.0, 0.0, -1.0])
    for step in range(1, most_steps + 1):
        if physics.following and step % 10 == 1:
            down = -_normals(data.xpos[1:] if step > 1 else rough, laid)[moves]
        data.xfrc_applied[bodies, :3] = force * min(1.0, step / physics.ramp_steps) * down
        mujoco.mj_step(model, data)
        if step % 10 == 0 and step > _FITTING_STEPS:
            most = max(most, _strain(data.xpos[1:], laid))
        if step % 20 == 0 and step > physics.ramp_steps:
            speed = float(np.abs(data.qvel).max()) * _STEP_S
            if speed < MOST_SPEED_MM:
                break
    nodes = np.array(data.xpos[1:])
    strain = _strain(nodes, laid)
    good = bool(np.isfinite(nodes).all() and strain <= MOST_STRAIN and speed < MOST_SPEED_MM)
    return Settled(nodes, strain, most, speed, step, time.process_time() - began, good)


def _strain(nodes: np.ndarray, laid: net.Net) -> float:
    """Return the largest strain of any fibre's segment."""
    a, b = nodes[laid.edges[:, 0]], nodes[laid.edges[:, 1]]
    return float(np.abs(np.linalg.norm(a - b, axis=1) / laid.spacing_mm - 1).max())


def _xml(pocket: Pocket, laid: net.Net, moves: np.ndarray, physics: Physics, flat: bool, recipe: Recipe) -> str:
    material, pressure = recipe.material, recipe.loads.pressure_mpa
    spacing = laid.spacing_mm
    mass = physics.mass * spacing**2
    # Friction of the ply between a sliding rim node and the ply's edge, which acts in each of the two directions.
    loss = np.zeros(len(moves))
    rim = (laid.kinds != 0) & moves
    if physics.margin_mm:
        loss[rim] = physics.margin_mm
    free = laid.kinds == 2
    if free.any() and len(pocket.ply_outline_mm):
        loss[free] = np.maximum(distance_to_outline(pocket.ply_outline_mm, laid.nodes_mm[free, :2]), spacing)
    loss *= physics.friction * pressure * spacing
    dim, grip = (3, f"{physics.friction} 0 0") if physics.friction > 0 else (1, "0 0 0")
    # MuJoCo's default friction is softer: light nodes creep under any force, and the rim of a pocket gave way at once.
    held = f'solreffriction="{2 * _STEP_S} 1" solimpfriction="{_IMPEDANCE} {_IMPEDANCE} 0.001"'
    bodies = []
    for i, (x, y, z) in enumerate(_relaxed(laid)):
        joints = ""
        if moves[i]:
            dry = f' frictionloss="{loss[i]:.9g}" {held}' if loss[i] > 0 else ""
            joints = (
                f'<joint type="slide" axis="1 0 0"{dry}/><joint type="slide" axis="0 1 0"{dry}/>'
                '<joint type="slide" axis="0 0 1"/>'
            )
        bodies.append(
            f'<body name="n{i}" pos="{x:.12g} {y:.12g} {z:.12g}">{joints}<geom type="sphere" size="{_SPHERE_MM}" '
            f'mass="{mass:.9g}" contype="1" conaffinity="2" condim="{dim}" friction="{grip}"/></body>'
        )
    solver = f'solref="{2 * _STEP_S} 1" solimp="{_IMPEDANCE} {_IMPEDANCE} 0.001"'
    common = f'contype="2" conaffinity="1" condim="{dim}" friction="{grip}" {solver}'
    asset = ""
    if flat:
        mold = f'<geom type="plane" size="0 0 1" pos="0 0 {-_SPHERE_MM}" {common}/>'
    else:
        rows, columns = pocket.mold_mm.shape
        half_x, half_y = pocket.grid_mm * (columns - 1) / 2, pocket.grid_mm * (rows - 1) / 2
        low, rise = float(pocket.mold_mm.min()), float(np.ptp(pocket.mold_mm))
        asset = f'<asset><hfield name="mold" nrow="{rows}" ncol="{columns}" size="{half_x} {half_y} {rise} 5"/></asset>'
        centre = pocket.origin_mm + np.array([half_x, half_y])
        mold = f'<geom type="hfield" hfield="mold" pos="{centre[0]} {centre[1]} {low - _SPHERE_MM}" {common}/>'
    count = len(laid.nodes_mm)
    nodes = f'body="{" ".join(f"n{i}" for i in range(count))}" vertex="{" ".join(["0 0 0"] * count)}"'
    young = physics.young_mpa * material.thickness_mm**3 / 12 * spacing / (np.pi * _ROD_MM**4 / 4)
    off = '<contact contype="0" conaffinity="0" selfcollide="none"/>'
    flexes, holds = [], []
    for fibre in (0, 1):
        ahead = laid.neighbours[:, 2 * fibre]
        pairs = " ".join(f"{i} {ahead[i]}" for i in np.flatnonzero(ahead >= 0))
        if not pairs:
            continue
        flexes.append(
            f'<flex name="f{fibre}" dim="1" radius="{_ROD_MM}" {nodes} element="{pairs}">{off}<elasticity '
            f'young="{young:.9g}" poisson="0"/></flex>'
        )
        holds.append(f'<flex flex="f{fibre}" {solver}/>')
    triangles = " ".join(f"{a} {b} {c}" for a, b, c in _triangles(laid.neighbours))
    if triangles:
        flexes.append(
            f'<flex name="shear" dim="2" radius="{_SPHERE_MM}" {nodes} element="{triangles}">{off}<elasticity '
            f'young="{2 * material.shear_mpa}" poisson="0" thickness="{material.thickness_mm}" elastic2d="stretch"/>'
            "</flex>"
        )
    return (
        f'<mujoco><option timestep="{_STEP_S}" integrator="discrete" gravity="0 0 0" solver="Newton" iterations="60" '
        f'tolerance="1e-10" cone="elliptic"/><size memory="1G"/>{asset}<worldbody>{mold}{"".join(bodies)}</worldbody>'
        f"<deformable>{''.join(flexes)}</deformable><equality>{''.join(holds)}</equality></mujoco>"
    )


def _relaxed(laid: net.Net) -> np.ndarray:
    """Return (N, 3) the ply without stress: flat, with straight fibres at right angles.

    MuJoCo measures bending and shear from this state. If rods start on the draped surface instead, they never come to
    rest.
    """
    return np.column_stack([laid.lattice * laid.spacing_mm, np.zeros(len(laid.lattice))])


def _triangles(neighbours: np.ndarray) -> list[tuple[int, int, int]]:
    """Return two triangles for every cell; the diagonals alternate, so that no direction is favoured."""
    found: list[tuple[int, int, int]] = []
    for i, (east, _, north, _) in enumerate(neighbours):
        if east < 0 or north < 0 or neighbours[east, 2] < 0 or neighbours[east, 2] != neighbours[north, 0]:
            continue
        corner = int(neighbours[east, 2])
        if len(found) % 4 < 2:
            found += [(i, int(east), corner), (i, corner, int(north))]
        else:
            found += [(i, int(east), int(north)), (int(east), corner, int(north))]
    return found


def _set_lengths(model: mujoco.MjModel, laid: net.Net) -> None:
    """Set the rest length of all segments to the spacing, to the last digit."""
    for flex in np.flatnonzero(model.flex_dim == 1):
        first, count = model.flex_edgeadr[flex], model.flex_edgenum[flex]
        model.flexedge_length0[first : first + count] = laid.spacing_mm


def _set_mold(model: mujoco.MjModel, pocket: Pocket) -> None:
    heights = pocket.mold_mm - pocket.mold_mm.min()
    model.hfield_data[:] = (heights / heights.max()).ravel()


def _noise(xy: np.ndarray, seed: int, amplitude_mm: float) -> np.ndarray:
    """Return (N,) a smooth random field with this root mean square and waves of 5 to 20 mm."""
    rng = np.random.default_rng([7, seed])
    waves = 2 * np.pi / rng.uniform(5, 20, 24)
    turn, phase = rng.uniform(0, 2 * np.pi, (2, 24))
    field = np.cos(np.outer(xy[:, 0], waves * np.cos(turn)) + np.outer(xy[:, 1], waves * np.sin(turn)) + phase)
    return np.asarray(amplitude_mm * np.sqrt(2 / 24) * field.sum(axis=1))


def _normals(nodes: np.ndarray, laid: net.Net) -> np.ndarray:
    """Return (N, 3) upward normals of the ply."""
    e, w, n, s = (np.where(laid.neighbours[:, k] >= 0, laid.neighbours[:, k], np.arange(len(nodes))) for k in range(4))
    normal = np.cross(nodes[e] - nodes[w], nodes[n] - nodes[s])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return np.where(length > 0, normal / np.maximum(length, 1e-12), (0.0, 0.0, 1.0))
