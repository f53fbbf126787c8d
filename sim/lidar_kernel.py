"""What a lidar reports of what its beams meet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slam.kernels.jit import inlined, njit

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Codes = NDArray[np.int8]
Met = tuple[Singles, Singles, Codes]
"""What beams meet: range (N,) [m], inf where nothing; cosine of the incidence angle (N,); material (N,)."""

Optics = tuple[float, tuple[float, float, float], Floats, tuple[float, float, float, float]]

MATTE, DARK, GLOSSY, GLASS = 0, 1, 2, 3
DIGITS = 8192.0
"""A uniform draw of 53 bits is four of 13, see `_chance`."""
STEEPEST = 10.0
"""Largest tangent of the incidence angle that counts: beyond 84 deg the spot runs off the surface."""


@njit
def planes_met(triangles: NDArray[np.int32], planes: Floats, materials: Codes, rays: tuple[Singles, Singles]) -> Met:
    """What rays of origins (N, 3) and directions (N, 3) meet on triangles (N,) of known planes (M, 4); -1: nothing."""
    origins, directions = rays
    ranges = np.full(len(triangles), np.inf, np.float32)
    cosines = np.ones(len(triangles), np.float32)
    codes = np.zeros(len(triangles), np.int8)
    for i in range(len(triangles)):
        k = triangles[i]
        if k < 0:
            continue
        a, b, c = planes[k, 0], planes[k, 1], planes[k, 2]
        towards = -(a * directions[i, 0] + b * directions[i, 1] + c * directions[i, 2])
        height = a * origins[i, 0] + b * origins[i, 1] + c * origins[i, 2]
        ranges[i] = (height - planes[k, 3]) / towards
        cosines[i] = min(abs(towards), 1.0)
        codes[i] = materials[k]
    return ranges, cosines, codes


@njit
def see_through(met: Met, behind: Met, chances: Floats, glass: tuple[float, float, float]) -> None:
    """Replace panes by what is `behind` them, but for the share that is seen.

    Args:
        met: replaced in place.
        behind: what the beams would meet without panes.
        chances: (N,) in 0..1.
        glass: cosine of the glare's edge, share of the panes that are seen in the glare, and outside it.
    """
    ranges, cosines, codes = met
    for i in range(len(ranges)):
        if codes[i] == GLASS and chances[i] >= (glass[1] if cosines[i] > glass[0] else glass[2]):
            ranges[i], cosines[i], codes[i] = behind[0][i], behind[1][i], behind[2][i]


@njit
def report(
    met: Met, draws: tuple[Floats, Floats], optics: Optics, model: tuple[float, ...], biases: Floats, limits: tuple[float, float]
) -> Floats:
    """What the device reports (N,) [m] of what its beams have met: `blend`, `lose` and `measure` in one call.

    Args:
        met: see `Met`.
        draws: (N,) uniform in 0..1, (N,) standard normal.
        optics: spot and edge of `blend`, reaches and shares of `lose`.
        model: see `measure`.
        biases: see `measure`.
        limits: least and greatest range [m].
    """
    ranges = blend(met, optics[0], optics[1], draws[0])
    lose(ranges, met, optics[2], optics[3], draws[0])
    return measure(ranges, met[1], draws[1], model, biases, limits)


@inlined
def blend(met: Met, spot: float, edge: tuple[float, float, float], draws: Floats) -> Floats:
    """Ranges (N,) [m] of spots that may straddle a depth edge: between the two depths, or nan where the device gives up.

    Where between two beams an edge lies is drawn. The part of the spot beyond the edge counts by its width and, as light falls off,
    by the inverse square of its range.

    Args:
        met: what the beams' centres meet.
        spot: width of the lit spot, in angles between two beams.
        edge: by how much more than on one slanted surface two ranges beside an edge differ [m], share of the spots on an edge that
            give an error code, angle from beam to beam [rad].
        draws: (N,) uniform in 0..1.
    """
    ranges = met[0]
    blended = ranges.astype(np.float64)
    for i in range(len(ranges)):
        near, beyond = float(ranges[i]), 0.0
        for j in (i - 1, i + 1):
            if j < 0 or j >= len(ranges) or not abs(ranges[j] - near) > edge[0]:
                continue
            if abs(ranges[j] - near) < edge[0] + 1.5 * edge[2] * max(_slope(met, i), _slope(met, j)):
                continue
            gap = _chance(draws[i], 0) if j > i else 1.0 - _chance(draws[j], 0)
            share = 0.5 - gap / spot
            if share > beyond:
                beyond = share
                blended[i] = _between(near, float(ranges[j]), share)
        if beyond > 0.0 and _chance(draws[i], 1) < edge[1]:
            blended[i] = np.nan
    return blended


@inlined
def _slope(met: Met, i: int) -> float:
    """How fast the range changes with the beam's angle on the surface that beam i meets [m/rad]; 0 where it meets nothing."""
    r, cosine = float(met[0][i]), float(met[1][i])
    return r * np.sqrt(1.0 / max(cosine * cosine, 1e-6) - 1.0) if np.isfinite(r) else 0.0


@inlined
def _between(own: float, other: float, share: float) -> float:
    """Range of a spot of which `share` lies at another depth; nothing there gives no light."""
    if not (np.isfinite(own) and np.isfinite(other)):
        return min(own, other)
    a, b = (1.0 - share) / (own * own), share / (other * other)
    return (a * own + b * other) / (a + b)


@inlined
def lose(ranges: Floats, met: Met, reaches: Floats, shares: tuple[float, float, float, float], draws: Floats) -> None:
    """Put nan (an error code) or inf (nothing in range) where too little or too much light comes back.

    Args:
        ranges: (N,) [m], changed in place.
        met: cosines and materials count.
        reaches: (4,) by material [m].
        shares: cosine of the glare's edge, then shares: of the glare that blinds, of the losses on gloss that look like nothing, of
            all beams that fail.
        draws: (N,) uniform in 0..1.
    """
    glare, blinds, silent, fails = shares
    for i in range(len(ranges)):
        cosine, material, chance = met[1][i], met[2][i], _chance(draws[i], 2)
        glaring = material == GLOSSY and cosine > glare
        reach = reaches[material] * np.sqrt(cosine) * (0.95 + 0.1 * chance)
        if _chance(chance, 1) < fails or (glaring and chance < blinds):
            ranges[i] = np.nan
        elif not glaring and reach < ranges[i] < np.inf:
            ranges[i] = np.inf if material == GLOSSY and chance < silent else np.nan


@inlined
def measure(
    ranges: Floats, cosines: Singles, normals: Floats, model: tuple[float, ...], biases: Floats, limits: tuple[float, float]
) -> Floats:
    """What is reported (N,) [m]: ranges with bias and noise in whole steps, REP 117 outside the limits.

    Args:
        ranges: (N,) of the spots [m].
        cosines: (N,) of the incidence angles.
        normals: (N,) standard normal.
        model: near sigma [m], far sigma, spot, sigma and bias on slants (shares), steps [1/m], `biases` [1/m].
        biases: (K,) at evenly spaced ranges from 0 on [m]; linear between.
        limits: least and greatest range [m].
    """
    near, far, spot, slant_sigma, slant_bias, steps, density = model
    reported = np.empty(len(ranges))
    for i in range(len(ranges)):
        r = ranges[i]
        if np.isfinite(r):
            cosine = float(cosines[i])
            depth = spot * r * min(np.sqrt(1.0 / max(cosine * cosine, 1e-6) - 1.0), STEEPEST)
            sigma = np.sqrt(max(near, far * r) ** 2 + (slant_sigma * depth) ** 2)
            place = r * density
            k = min(int(place), len(biases) - 2)
            bias = biases[k] + (place - k) * (biases[k + 1] - biases[k])
            r = np.rint((r + bias - slant_bias * depth + sigma * normals[i]) * steps) / steps
        if r < limits[0]:
            r = -np.inf
        elif r > limits[1]:
            r = np.inf
        reported[i] = r
    return reported


@inlined
def _chance(draw: float, place: int) -> float:
    """One of four independent uniform numbers in 0..1 from the digits of one."""
    for _ in range(place):
        draw = DIGITS * draw - np.floor(DIGITS * draw)
    return draw
