"""`twin print`, from the command line: the PDF is rasterised and its markers are found and measured."""

from pathlib import Path

import cv2
import numpy as np
import pypdfium2
import pytest

from scripts.cli import main
from slam.landmarks.boards import Board, BoardFinder

DPI = 200.0
MM = DPI / 25.4
"""[px]"""


def pages(path: Path) -> list[np.ndarray]:
    document = pypdfium2.PdfDocument(path)
    images = [document[k].render(scale=DPI / 72.0, grayscale=True).to_numpy().squeeze() for k in range(len(document))]
    document.close()
    return [np.ascontiguousarray(image) for image in images]


def found_markers(image: np.ndarray, dictionary: int) -> dict[int, np.ndarray]:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    corners, ids, _ = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary), parameters).detectMarkers(image)
    return {int(number): quad.reshape(4, 2) for number, quad in zip([] if ids is None else ids, corners, strict=True)}


def sides_mm(quad: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.roll(quad, -1, axis=0) - quad, axis=1) / MM


@pytest.mark.parametrize(("paper", "size"), [("a4", (210.0, 297.0)), ("letter", (215.9, 279.4))])
def test_every_marker_is_on_a_sheet_once_and_has_its_size(paper: str, size: tuple[float, float], tmp_path: Path, capsys) -> None:
    out = tmp_path / "m.pdf"
    assert main(["print", "markers", "--ids", "0-13,40", "--size", "0.05", "--paper", paper, "--out", str(out)]) == 0
    sheets = pages(out)
    assert "15 markers of 0.05 m on 2 sheets" in capsys.readouterr().out
    assert len(sheets) == 2
    assert sorted(np.array(sheets[0].shape) / MM) == pytest.approx(size, abs=0.2)
    found = [found_markers(sheet, cv2.aruco.DICT_ARUCO_MIP_36h12) for sheet in sheets]
    assert sorted([*found[0], *found[1]]) == [*range(14), 40]
    assert np.concatenate([sides_mm(quad) for sheet in found for quad in sheet.values()]) == pytest.approx(50.0, abs=0.15)


def test_the_scale_bar_is_a_hundred_millimetres_long(tmp_path: Path) -> None:
    assert main(["print", "markers", "--out", str(tmp_path / "m.pdf")]) == 0
    image = pages(tmp_path / "m.pdf")[0]
    row = image[image.shape[0] - round(10.5 * MM)] < 128
    first = int(row.argmax())
    assert int((~row[first:]).argmax()) / MM == pytest.approx(100.0, abs=0.4)


def test_a_marker_keeps_a_white_margin_of_a_module(tmp_path: Path) -> None:
    assert main(["print", "markers", "--ids", "7", "--out", str(tmp_path / "m.pdf")]) == 0
    image = pages(tmp_path / "m.pdf")[0]
    quad = found_markers(image, cv2.aruco.DICT_ARUCO_MIP_36h12)[7]
    (left, top), (right, low) = quad.min(axis=0), quad.max(axis=0)
    module = round((right - left) / 8) - 2
    ring = np.concatenate(
        [
            image[round(top) - module : round(top) - 2, round(left) : round(right)].ravel(),
            image[round(top) : round(low), round(right) + 3 : round(right) + module].ravel(),
        ]
    )
    assert ring.min() > 250


PRINTED = {
    "": Board(),
    "--squares 7 5 --square 0.03 --marker 0.015": Board(columns=7, rows=5, square=0.03, marker=0.015),
    "--kind chessboard --squares 6 8 --square 0.03": Board("chessboard", 6, 8, 0.03),
}


@pytest.mark.parametrize(("options", "board"), PRINTED.items())
def test_a_board_is_printed_at_true_scale(options: str, board: Board, tmp_path: Path) -> None:
    assert main(["print", "board", "--out", str(tmp_path / "b.pdf"), *options.split()]) == 0
    found = BoardFinder(board).find(pages(tmp_path / "b.pdf")[0])
    assert found is not None
    corners = 1e3 * board.corners[found.numbers, :2] * MM
    spans = [np.linalg.norm(points[0] - points[-1]) for points in (corners, found.pixels)]
    assert spans[1] == pytest.approx(spans[0], rel=2e-3)


def test_the_same_print_has_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.pdf", "b.pdf"):
        assert main(["print", "markers", "--out", str(tmp_path / name)]) == 0
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


@pytest.mark.parametrize(
    ("argv", "problem"),
    [
        ("markers --ids 0-300", "DICT_ARUCO_MIP_36h12 has 250 ids, 0 to 249"),
        ("markers --ids 5-2", "give numbers and ranges as 0-11,20"),
        ("markers --ids many", "give numbers and ranges"),
        ("markers --size 0.3", "with its margin it does not fit on a4; at most 0.152 m"),
        ("markers --size 0", "size = 0.0; must be above 0"),
        ("markers --dictionary DICT_9", "dictionary = DICT_9; must be a name such as"),
        ("board --square 0.05 --marker 0.025", "the board is 250 x 350 mm; a4 has room for 190 x 259 mm"),
        ("board --marker 0.0271", "a simple part of the square"),
        ("poster", "nothing called 'poster' to print; available: board, markers"),
    ],
)
def test_what_cannot_be_printed_is_said_and_nothing_is_written(argv: str, problem: str, tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["print", *argv.split()]) == 2
    assert problem in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
