"""How far the lidar is from a perfect one: every number of it. The sources are in docs/realism.md."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class LidarErrors:
    """Errors of the lidar; the defaults are none."""

    range_sigma: float = 0.0
    """Standard deviation of near ranges at normal incidence [m]."""
    range_sigma_share: float = 0.0
    """Standard deviation of far ranges at normal incidence, as a share of the range."""
    offset_sigma: float = 0.0
    """Standard deviation of a device's constant bias, drawn at every reset [m]."""
    cyclic_bias: float = 0.0
    """Amplitude of the bias that swings with range, its phase drawn at every reset [m]."""
    cyclic_length: float = 3.2
    """Range after which the swinging bias repeats [m]."""
    warm_up: float = 0.0
    """Bias at switch-on, which fades [m]."""
    warm_up_time: float = 1200.0
    """Time in which the bias at switch-on falls to 37 % [s]."""
    spot: float = 0.0
    """Width of the lit spot, as a share of the range."""
    incidence_sigma: float = 0.0
    """Standard deviation added on slanted surfaces, as a share of the lit spot's depth (spot x range x tan of the incidence angle)."""
    incidence_bias: float = 0.0
    """How much nearer slanted surfaces seem, as a share of the lit spot's depth."""
    edge_depth: float = math.inf
    """Two neighbouring beams whose ranges differ by so much more than on one slanted surface have an edge between them [m]."""
    edge_reject: float = 0.0
    """Share of the beams with a depth edge in their spot that give an error code instead of a range between."""
    dropout: float = 0.0
    """Share of all beams that give an error code for no reason seen."""
    matte_reach: float = math.inf
    """Range at which a matte surface, met at a right angle, gives too little light [m]; it goes with the root of the cosine."""
    dark_reach: float = math.inf
    """The same of a dark surface [m]."""
    glossy_reach: float = math.inf
    """The same of a glossy surface outside its glare [m]."""
    glare: float = 0.0
    """Incidence angle up to which a glossy surface or a pane throws the beam straight back [rad]."""
    glare_blinds: float = 0.0
    """Share of the beams in the glare of a glossy surface that give an error code."""
    gloss_silent: float = 0.0
    """Share of the beams lost on a glossy surface that look like nothing in range; the others give an error code."""
    pane_seen: float = 1.0
    """Share of the beams in the glare of a pane that give the pane."""
    pane_seen_aslant: float = 1.0
    """Share of the other beams that give the pane; the rest give what is behind it."""


DATASHEET = LidarErrors(
    range_sigma=0.010,  # data sheet: +-30 mm to 1 m, +-3 % beyond, read as three sigma
    range_sigma_share=0.01,
    offset_sigma=0.002,
    cyclic_bias=0.002,
    spot=0.010,  # data sheet: 20 mm at 2 m, 40 mm at 4 m
    incidence_sigma=0.10,
    incidence_bias=0.05,
    edge_depth=0.05,
    edge_reject=0.3,
    dropout=0.001,
    matte_reach=9.0,
    dark_reach=2.5,
    glossy_reach=1.2,
    glare=math.radians(4.0),
    glare_blinds=0.5,
    gloss_silent=0.5,
    pane_seen=0.7,
    pane_seen_aslant=0.03,
)

HARSH = replace(
    DATASHEET,
    range_sigma=0.020,
    range_sigma_share=0.02,
    offset_sigma=0.004,
    cyclic_bias=0.004,
    incidence_sigma=0.2,
    incidence_bias=0.1,
    edge_reject=0.5,
    dropout=0.02,
    matte_reach=6.0,
    dark_reach=1.5,
    glossy_reach=0.8,
    pane_seen=0.5,
)
