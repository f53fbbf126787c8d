"""Feature points by name, and networks in ONNX files: real ones, as small as can be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from slam.landmarks.feature_network import FeatureNetwork, FeatureNetworkError
from slam.landmarks.features import FEATURES, OnnxFeatures, Orb, Sift, matched, spread

SHIFT = 12


@pytest.fixture(scope="module")
def picture() -> np.ndarray:
    """Rectangles of all greys."""
    rng, picture = np.random.default_rng(3), np.full((160, 240), 128, np.uint8)
    for _ in range(120):
        x, y, w, h = rng.integers(0, (220, 140, 24, 24))
        picture[y : y + h + 4, x : x + w + 4] = rng.integers(0, 255)
    return picture


def write(path: Path, nodes: list[onnx.NodeProto], weights: dict[str, np.ndarray], outputs: dict[str, list[object]]) -> Path:
    graph = helper.make_graph(
        nodes,
        "features",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 1, "h", "w"])],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in outputs.items()],
        [numpy_helper.from_array(values.astype(np.float32), name) for name, values in weights.items()],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8), path)
    return path


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A heat map of corners (a checker of four quarters, rectified) and descriptors: patches of 8 x 8, at every second pixel."""
    corner = np.kron(np.array([[1, -1], [-1, 1]]), np.ones((4, 4))) / 32.0
    patches = np.eye(64).reshape(64, 1, 8, 8) - 1.0 / 64.0
    nodes = [
        helper.make_node("Conv", ["image", "corner"], ["found"], pads=[4, 4, 3, 3]),
        helper.make_node("Abs", ["found"], ["heat"]),
        helper.make_node("Conv", ["image", "patches"], ["descriptors"], pads=[3, 3, 3, 3], strides=[2, 2]),
    ]
    outputs: dict[str, list[object]] = {"heat": [1, 1, "h", "w"], "descriptors": [1, 64, "a", "b"]}
    return write(tmp_path_factory.mktemp("net") / "corners.onnx", nodes, {"corner": corner[None, None], "patches": patches}, outputs)


def build(name: str, network: Path) -> object:
    return OnnxFeatures(str(network), threshold=0.05).build() if name == "onnx" else FEATURES[name]().build()


@pytest.mark.parametrize("name", sorted(FEATURES))
def test_points_of_a_shifted_picture_are_found_again(name: str, picture: np.ndarray, network: Path) -> None:
    extractor = build(name, network)
    a, b = extractor.find(picture), extractor.find(np.roll(picture, SHIFT, axis=1))
    pairs = matched(a, b)
    off = b.pixels[pairs[:, 1]] - a.pixels[pairs[:, 0]] - [SHIFT, 0]
    assert len(pairs) > 30
    assert np.mean(np.hypot(*off.T) < 2.0) > 0.7
    assert (np.diff(a.strengths) <= 0.0).all()


@pytest.mark.parametrize("features", [Orb(), Sift()])
def test_nothing_is_found_on_a_blank_picture(features: Orb | Sift) -> None:
    found = features.build().find(np.full((160, 240), 90, np.uint8))
    assert found.pixels.shape == (0, 2)
    assert len(matched(found, found)) == 0


def test_scores_in_cells_are_put_back_in_their_pixels(tmp_path: Path) -> None:
    """A network that answers with 64 channels and "none": the brightest pixel of a cell is its point."""
    fold = 50.0 * np.concatenate([np.eye(64), np.zeros((1, 64))]).reshape(65, 1, 8, 8)
    nodes = [
        helper.make_node("Conv", ["image", "fold"], ["semi"], strides=[8, 8]),
        helper.make_node("Conv", ["image", "mean"], ["desc"], strides=[8, 8]),
    ]
    weights = {"fold": fold, "mean": np.stack([np.full((1, 8, 8), 1 / 64), np.full((1, 8, 8), 0.5)])}
    file = write(tmp_path / "cells.onnx", nodes, weights, {"semi": [1, 65, "a", "b"], "desc": [1, 2, "a", "b"]})
    picture = np.zeros((64, 96), np.uint8)
    picture[21, 43] = picture[50, 70] = 255
    pixels, descriptors, scores = FeatureNetwork.read(str(file)).run(picture)
    found = {(int(u), int(v)) for (u, v), score in zip(pixels, scores, strict=True) if score > 0.5}
    assert found == {(43, 21), (70, 50)}
    np.testing.assert_allclose(np.linalg.norm(descriptors[scores > 0.5], axis=1), 1.0, atol=1e-5)


def test_a_file_that_is_missing_or_no_network_is_named(tmp_path: Path) -> None:
    with pytest.raises(FeatureNetworkError, match="no feature network at"):
        OnnxFeatures(str(tmp_path / "none.onnx")).build()
    broken = tmp_path / "broken.onnx"
    broken.write_bytes(b"not a network")
    with pytest.raises(FeatureNetworkError, match=r"broken\.onnx is no network"):
        OnnxFeatures(str(broken)).build()


def test_outputs_that_are_no_features_are_named(tmp_path: Path) -> None:
    file = write(tmp_path / "other.onnx", [helper.make_node("Abs", ["image"], ["out"])], {}, {"out": [1, 1, "h", "w"]})
    with pytest.raises(FeatureNetworkError, match="answers with"):
        FeatureNetwork.read(str(file)).run(np.zeros((64, 64), np.uint8))


def test_points_are_spread_before_they_are_strong() -> None:
    pixels = np.array([[1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [200.0, 100.0]])
    assert spread(pixels, np.array([9.0, 8.0, 7.0, 1.0]), 2).tolist() == [0, 3]
