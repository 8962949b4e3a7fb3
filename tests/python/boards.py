"""Virtual boards before two cameras that are known: their corners, and images of them."""

import cv2
import numpy as np

from debulk.scanner.stereo_fit import Pair

PIXELS = 560, 420
MATRICES = [
    np.array([[630.0, 0, 283], [0, 631, 207], [0, 0, 1]]),
    np.array([[634.0, 0, 278], [0, 633, 212], [0, 0, 1]]),
]
DISTORTIONS = [np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]), np.array([-0.08, 0.03, -2e-4, 1e-4, 0.0])]
ROTATION = cv2.Rodrigues(np.array([0.01, 0.12, 0.005]))[0]
TRANSLATION = np.array([-120.0, 1.5, 8.0])
DISTANCE_MM = 480.0
NINTHS = [(-1, -1), (1, 1), (1, -1), (-1, 1), (0, 0), (-1, 0), (1, 0), (0, 1), (0, -1)]
"""Of the image, the corners first."""


def seen(points, turn, move, k):
    """(N, 2) pixels at which camera k sees points of a board, x_left = turn @ x + move."""
    axes, origin = (turn, move) if k == 0 else (ROTATION @ turn, ROTATION @ move + TRANSLATION)
    return cv2.projectPoints(points, cv2.Rodrigues(axes)[0], origin, MATRICES[k], DISTORTIONS[k])[0].reshape(-1, 2)


def places(board, count, rng, tilt_deg=25.0, roll_deg=8.0):
    """Places at which both cameras see the whole board, one after another in each of the `NINTHS`."""
    middle = board.square_mm * np.array([*board.squares, 0]) / 2
    rim = board.square_mm * np.array([[x, y, 0] for x in (0, board.squares[0]) for y in (0, board.squares[1])], float)
    found = []
    while len(found) < count:
        k = len(found)
        axis = np.array([np.cos(2.4 * k), np.sin(2.4 * k), 0])
        turn = cv2.Rodrigues(np.deg2rad(tilt_deg * rng.uniform(0.7, 1.0)) * axis)[0]
        turn = turn @ cv2.Rodrigues(np.deg2rad([0, 0, rng.uniform(-roll_deg, roll_deg)]))[0]
        z = rng.uniform(430, 620)
        for inwards in np.linspace(1, 0, 21):
            offset = inwards * z * np.array([*NINTHS[k % 9], 0]) * [0.45, 0.35, 0]
            move = np.array([45.0, 0, z]) + offset - turn @ middle
            at = np.concatenate([seen(rim, turn, move, c) for c in (0, 1)])
            if (at > 3).all() and (at < np.array(PIXELS) - 4).all():
                found.append((turn, move))
                break
    return found


def corner_pairs(board, where, noise_px, rng):
    """The corners that both cameras see, without images."""
    return [
        Pair(
            f"{k + 1}",
            board.corners_mm,
            *(seen(board.corners_mm, *place, c) + rng.normal(0, noise_px, (len(board.corners_mm), 2)) for c in (0, 1)),
        )
        for k, place in enumerate(where)
    ]


def drawn(board, place, k, rng, blur_px=0.7):
    """What camera k sees of a board, 8 bits."""
    turn, move = place
    scale = 28
    texture = board.image(scale)
    column, row = np.meshgrid(np.arange(PIXELS[0], dtype=float), np.arange(PIXELS[1], dtype=float))
    pixels = np.stack([column.ravel(), row.ravel()], 1)[:, None]
    rays = np.pad(
        cv2.undistortPoints(pixels, MATRICES[k], DISTORTIONS[k]).reshape(-1, 2), ((0, 0), (0, 1)), constant_values=1
    )
    axes, origin = (turn, move) if k == 0 else (ROTATION @ turn, ROTATION @ move + TRANSLATION)
    where = np.linalg.solve(np.column_stack([axes[:, 0], axes[:, 1], origin]), rays.T)
    u, v = (where[:2] / where[2] / board.square_mm + 1) * scale - 0.5  # the margin is a square wide
    at = [values.reshape(column.shape).astype(np.float32) for values in (u, v)]
    image = cv2.remap(texture, *at, cv2.INTER_LINEAR, borderValue=128)
    soft = cv2.GaussianBlur(image, (0, 0), blur_px) * 0.8 + 20
    return np.clip(soft + rng.normal(0, 1.0, soft.shape), 0, 255).astype(np.uint8)


def measured(points, calibration):
    """Points as the calibration measures them, rectified, from the pixels at which the true cameras see them."""
    (k1, k2), (d1, d2) = calibration.camera_matrices, calibration.distortions
    turns = cv2.stereoRectify(k1, d1, k2, d2, PIXELS, calibration.rotation, calibration.translation_mm[:, None])[:2]
    (x, y), (x_right, _) = (
        cv2.undistortPoints(
            seen(points, np.eye(3), np.zeros(3), k)[:, None],
            calibration.camera_matrices[k],
            calibration.distortions[k],
            R=turns[k],
            criteria=(3, 100, 1e-10),
        )
        .reshape(-1, 2)
        .T
        for k in (0, 1)
    )
    z = np.linalg.norm(calibration.translation_mm) / (x - x_right)
    return np.column_stack([x * z, y * z, z])


def height_errors(calibration, height_mm=10.0):
    """Errors of the height of a bump over the field, mm, and how far a plane there is from flat."""
    across, down = np.linspace(28, PIXELS[0] - 29, 9), np.linspace(21, PIXELS[1] - 22, 7)
    pixels = np.stack(np.meshgrid(across, down), -1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(pixels, MATRICES[0], DISTORTIONS[0], criteria=(3, 100, 1e-10)).reshape(-1, 2)
    base = np.column_stack([rays, np.ones(len(rays))]) * DISTANCE_MM
    there = seen(base, np.eye(3), np.zeros(3), 1)
    base = base[((there >= 0) & (there <= np.array(PIXELS) - 1)).all(axis=1)]
    low, high = (measured(base - [0, 0, up], calibration) for up in (0.0, height_mm))
    normal = np.linalg.svd(low - low.mean(axis=0))[2][2]
    normal *= -np.sign(normal[2])
    return (high - low) @ normal - height_mm, (low - low.mean(axis=0)) @ normal
