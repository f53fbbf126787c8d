from pathlib import Path

import numpy as np
import pytest

from slam.errors import PoseGraphError
from slam.mapping.g2o_file import read_g2o

EDGE = "EDGE_SE2 0 1 1 0 0.5 4 0.1 0.2 5 0.3 6"


def _written(folder: Path, *lines: str) -> Path:
    path = folder / "graph.g2o"
    path.write_text("\n".join(lines))
    return path


def test_reads_poses_and_edges(tmp_path: Path) -> None:
    graph = read_g2o(_written(tmp_path, "# two nodes", "VERTEX_SE2 1 1.5 2 3", "", "VERTEX_SE2 0 0 0 0", EDGE))
    assert graph.poses.tolist() == [[0, 0, 0], [1.5, 2, 3]]
    assert graph.edges.nodes.tolist() == [[0, 1]]
    assert graph.edges.information[0].tolist() == [[4, 0.1, 0.2], [0.1, 5, 0.3], [0.2, 0.3, 6]]


def test_finds_the_poses_of_a_file_without_vertices(tmp_path: Path) -> None:
    graph = read_g2o(_written(tmp_path, EDGE, "EDGE_SE2 1 2 1 0 0.5 4 0 0 5 0 6"))
    assert np.allclose(graph.poses, [[0, 0, 0], [1, 0, 0.5], [1 + np.cos(0.5), np.sin(0.5), 1.0]])


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (["VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1"], "line 1: 'VERTEX_SE3:QUAT' must be one of"),
        ([EDGE, "EDGE_SE2 0 1 1 0 nan 4 0 0 5 0 6"], "line 2: .* finite numbers 'i j x y yaw"),
        ([EDGE, "EDGE_SE2 0 1 1"], "line 2: .* must be EDGE_SE2"),
        (["EDGE_SE2 0 1.5 1 0 0 4 0 0 5 0 6"], "line 1"),
        (["EDGE_SE2 0 1 1 0 0 -4 0 0 5 0 6"], "edge 0 1 .* positive definite"),
        (["EDGE_SE2 0 0 1 0 0 4 0 0 5 0 6"], "edge 0 0 must join two nodes"),
        (["VERTEX_SE2 0 0 0 0"], "holds no edge"),
        ([EDGE, "VERTEX_SE2 0 0 0 0"], "1 vertices; there must be one for each of the nodes 0 to 1"),
        ([EDGE, "EDGE_SE2 2 3 1 0 0 4 0 0 5 0 6"], "falls into 2 pieces"),
    ],
)
def test_names_what_is_wrong_with_a_file(tmp_path: Path, lines: list[str], told: str) -> None:
    with pytest.raises(PoseGraphError, match=told) as caught:
        read_g2o(_written(tmp_path, *lines))
    assert "\n" not in str(caught.value)


def test_names_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(PoseGraphError, match="cannot be read"):
        read_g2o(tmp_path / "none.g2o")
