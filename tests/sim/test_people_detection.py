"""OpenCV's people detector on figures drawn by a renderer of a few lines: it depends on the figures, not on the twin's camera."""

import math

import cv2
import numpy as np
import pytest

from sim.people import Walker
from sim.rays import EmbreeRays
from worlds.living import Person

WIDTH, HEIGHT, FOCAL = 256, 480, 612.0
CAMERA_HEIGHT, PITCH = 0.5, math.radians(8.0)
LIGHT = np.array([-0.6, 0.4, 0.7]) / math.sqrt(1.01)


def rays():
    u, v = np.meshgrid(np.arange(WIDTH) - WIDTH / 2, np.arange(HEIGHT) - HEIGHT / 2)
    d = np.column_stack([np.full(u.size, FOCAL), -u.ravel(), -v.ravel()]) / FOCAL
    c, s = math.cos(PITCH), math.sin(PITCH)
    d = d @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)


def picture(triangles, colours, rng):
    """Shaded picture of triangles before a grey background, with the noise and the blur of a camera."""
    directions = rays()
    origins = np.tile(np.array([0.0, 0.0, CAMERA_HEIGHT], np.float32), (len(directions), 1))
    hits = EmbreeRays(triangles.astype(np.float32))._scene.run(origins, directions, dists=20.0, query="INTERSECT")
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shades = colours * (0.5 + 0.5 * np.clip(normals @ LIGHT, 0.0, 1.0))[:, None]
    background = np.where(directions[:, 2:] > 0.0, 170.0, 120.0) * np.ones(3)
    image = np.where(hits[:, None] >= 0, shades[hits], background).reshape(HEIGHT, WIDTH, 3)
    return np.clip(cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0.0, 3.0, image.shape), 0, 255).astype(np.uint8)


def figure_at(seed, distance, yaw):
    """Triangles and colours of a person, every other one walking, at a distance before the camera."""
    rng = np.random.default_rng(seed)
    walker = Walker(Person(path=((0.0, 0.0), (50.0, 0.0)), speed=1.1, pauses=(5.0,), height=rng.uniform(1.6, 1.9), seed=seed))
    clock = 1.0 if seed % 2 else rng.uniform(10.0, 20.0)
    pose = walker.pose(clock)
    c, s = math.cos(yaw - pose.yaw), math.sin(yaw - pose.yaw)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    meshes, colours = [], []
    for part, frame in zip(walker.parts, walker.frames(np.array([[clock, 1.0]]))[:, 0], strict=True):
        for triangles, colour in part.meshes:
            placed = triangles @ frame[:9].reshape(3, 3).T + frame[9:] - (pose.x, pose.y, 0.0)
            meshes.append(placed @ turn.T + (distance, 0.0, 0.0))
            colours.append(np.tile(colour, (len(triangles), 1)))
    return np.concatenate(meshes), np.concatenate(colours).astype(float)


@pytest.fixture(scope="module")
def detect():
    hog = cv2.HOGDescriptor()
    hog.setSVMDetector(cv2.HOGDescriptor_getDefaultPeopleDetector())
    return lambda image: hog.detectMultiScale(image, winStride=(8, 8), padding=(16, 16), scale=1.1)[0]


def test_a_people_detector_finds_people_at_4_to_6_metres(detect):
    found = 0
    for seed in range(10):
        rng = np.random.default_rng(100 + seed)
        distance = rng.uniform(4.0, 6.0)
        image = picture(*figure_at(seed, distance, rng.uniform(-math.pi, math.pi)), rng)
        height = 1.75 * FOCAL / distance * 128 / 96
        found += any(abs(x + w / 2 - WIDTH / 2) < 0.2 * height and abs(h / height - 1) < 0.35 for x, _, w, h in detect(image))
    assert found >= 9


def test_a_people_detector_does_not_take_a_pillar_for_a_person(detect):
    angles = np.arange(48) * (math.tau / 48)
    for k, radius in enumerate((0.12, 0.15, 0.2, 0.25)):
        ring = np.column_stack([5.0 + radius * np.cos(angles), radius * np.sin(angles), np.zeros(48)])
        after, up = np.roll(ring, -1, axis=0), np.array([0.0, 0.0, 1.8])
        triangles = np.concatenate([np.stack([ring, after, after + up], 1), np.stack([ring, after + up, ring + up], 1)])
        image = picture(triangles, np.full((len(triangles), 3), 90.0 + 30.0 * k), np.random.default_rng(k))
        assert len(detect(image)) == 0
