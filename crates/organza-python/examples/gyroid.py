"""A volume, points and a mesh from arrays in one picture, the one of docs/python.md: a gyroid in a ball, a ring of points by their angle, a floor."""

import sys

import numpy as np

import organza as og

SIDE = 128
AROUND = 800
ACROSS = 100


def gyroid() -> np.ndarray:
    """Values in a cube from -1 to 1 along z, y, x: 0 outside of the ball, and how far inside of the surface else."""
    places = np.linspace(-1.0, 1.0, SIDE)
    z, y, x = np.meshgrid(places, places, places, indexing="ij")
    u, v, w = 8.0 * x, 8.0 * y, 8.0 * z
    surface = np.sin(u) * np.cos(v) + np.sin(v) * np.cos(w) + np.sin(w) * np.cos(u)
    ball = np.clip(12.0 * (0.95 - np.sqrt(x**2 + y**2 + z**2)), 0.0, 1.0)
    return np.clip(0.5 + surface / 3.0, 0.0, 1.0) * ball


def ring() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a torus with their normals and their angles about y."""
    turns = [np.linspace(0.0, 2.0 * np.pi, count, endpoint=False) for count in (AROUND, ACROSS)]
    around, across = (angles.ravel() for angles in np.meshgrid(*turns, indexing="ij"))
    outwards = np.stack([np.cos(around), np.zeros(len(around)), np.sin(around)], axis=1)
    normals = outwards * np.cos(across)[:, None] + np.array([0.0, 1.0, 0.0]) * np.sin(across)[:, None]
    return 1.45 * outwards + 0.12 * normals, normals, around


def main(out: str, size: tuple[int, int]) -> None:
    scene = og.Scene()
    step = 2.0 / (SIDE - 1)
    scene.add_volume(
        gyroid(),
        name="gyroid",
        spacing=step,
        origin=(-1.0, -1.0, -1.0),
        transfer=og.transfer("viridis", clim=(0.45, 0.95), opacity=[0.0, 0.5, 0.9], unit_length=0.05),
    )
    places, normals, angles = ring()
    scene.add_points(places, normals=normals, values=angles, colormap="turbo", clim=(0.0, 2.0 * np.pi), name="ring")
    corners = np.array([[-40.0, -1.05, -40.0], [-40.0, -1.05, 40.0], [40.0, -1.05, 40.0], [40.0, -1.05, -40.0]])
    scene.add_mesh(corners, np.array([[0, 1, 2, 3]]), name="floor", color=(0.5, 0.5, 0.52), technique="sheets", casts_shadow=False)
    scene.camera(position=(2.6, 2.2, 4.6), target=(0.0, -0.1, 0.0), fov_y=32)
    scene.light(direction=(-0.5, -1.0, -0.6), irradiance=(3.2, 3.1, 2.9), name="sun")
    scene.set("render.shadow.cells", 500)
    scene.set("ambient.color", [0.18, 0.2, 0.23])
    scene.set("background.color", [0.35, 0.4, 0.46])
    og.render(scene, size=size).save(out)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "gyroid.png", (960, 540))
