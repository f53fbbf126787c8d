"""From options to all that takes part in a run: body, pipeline, policy, map."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from hardware.fault_kinds import Fault
from hardware.faults import befall
from hardware.hal import Robot
from scripts.errors import UsageError
from scripts.runs.body import is_twin, make_robot, policy_name, route
from scripts.runs.folder import results_folder
from scripts.runs.known_map import GivenMap, read_given_map
from scripts.runs.options import RunOptions
from scripts.runs.parameters import read_parameters
from slam.errors import UnknownNameError
from slam.localization.amcl import Amcl
from slam.localization.landmarks import Landmarks
from slam.mapping.visual_slam import VisualSlam
from slam.navigation.explore import Explore
from slam.navigation.frontiers import Explorer
from slam.navigation.goal import GoTo, check_goal
from slam.navigation.policies import Policy, PolicySettings, make_policy
from slam.pipelines import LOCALIZERS, PIPELINES, LocalizerSettings, Pipeline, PipelineSettings, Resumable, warm_up
from slam.se2 import SE2
from worlds.loader import load_world

ENDING = ("explore", "goal")
"""Policies that know when they are done."""
SIMULATED = 60.0
"""Length of a simulated run when none is given [s]."""
FARTHEST_START = 100.0
"""The map reaches from its origin to the robot; beyond this it would be mostly nothing [m]."""


@dataclass(frozen=True)
class Assembly:
    """All that takes part in a run, nothing of it open yet."""

    options: RunOptions
    folder: Path
    robot: Robot
    pipeline: Pipeline
    policy: Policy
    duration: float
    """[s]; inf: as long as there is more."""
    given: GivenMap | None = None


def start_pose(options: RunOptions) -> SE2 | None:
    """`T_map_base` at the start; None when it is not told.

    Raises:
        UsageError: it is not finite or too far away.
    """
    if options.start is None:
        return None
    x, y, yaw_deg = options.start
    if not (math.hypot(x, y) <= FARTHEST_START and math.isfinite(yaw_deg)):
        raise UsageError(
            f"--start {x:g} {y:g} {yaw_deg:g}: give finite numbers, and a place within {FARTHEST_START:g} m of the map's origin"
        )
    return SE2(x, y, math.radians(yaw_deg))


def settings_of(options: RunOptions) -> PipelineSettings | LocalizerSettings:
    """Parameters of the pipeline that the options name.

    Raises:
        UsageError, UnknownNameError: there is no such pipeline, or it has no such parameters.
    """
    classes = LOCALIZERS if options.pipeline in LOCALIZERS else PIPELINES
    if options.pipeline not in classes:
        raise UnknownNameError("pipeline", options.pipeline, sorted([*PIPELINES, *LOCALIZERS]))
    return _with_markers(read_parameters(classes[options.pipeline], options.params), options)


def _with_markers(settings: PipelineSettings | LocalizerSettings, options: RunOptions) -> PipelineSettings | LocalizerSettings:
    """The settings with the files of the options that speak of markers."""
    told = {
        name: str(file) for name, file in (("marker_map", options.marker_map), ("camera_info", options.camera_info)) if file is not None
    }
    if not told:
        return settings
    looking = settings.landmarks if isinstance(settings, Amcl) else settings
    if not isinstance(looking, VisualSlam | Landmarks):
        name = f"--{next(iter(told)).replace('_', '-')}"
        raise UsageError(f"{name}: the pipeline '{options.pipeline}' does not look at markers; take visual_slam or amcl")
    markers = dataclasses.replace(looking.markers, camera_info=told.get("camera_info", looking.markers.camera_info))
    looking = dataclasses.replace(looking, markers=markers, marker_map=told.get("marker_map", looking.marker_map))
    return dataclasses.replace(settings, landmarks=looking) if isinstance(settings, Amcl) else looking


def assemble(options: RunOptions, settings: PipelineSettings | LocalizerSettings, faults: Sequence[Fault] = ()) -> Assembly:
    """All that takes part, the kernels compiled.

    Raises:
        UsageError, HardwareError, SimError, SlamError, WorldError: with one line that says what to do.
    """
    start, duration = start_pose(options), duration_of(options)
    robot = befall(make_robot(options), tuple(faults), options.seed) if faults else make_robot(options)
    given = _given_map(options)
    build = _builder(settings, given, start)
    T_map_start = start or SE2()
    if given is not None and is_twin(options):
        T_map_start = given.T_world_map.inverse() @ SE2(*load_world(options.world).start)
    name = policy_name(options, robot)
    policy = make_policy(name, route(options, T_map_start), policy_settings(name, options, given))
    pipeline = build()
    if options.session is not None:
        session_of(pipeline, options).resume(options.session)
    warm_up(build())
    return Assembly(options, results_folder(options), robot, pipeline, policy, duration, given)


def _builder(settings: PipelineSettings | LocalizerSettings, given: GivenMap | None, start: SE2 | None) -> Callable[[], Pipeline]:
    if given is None:
        return lambda: cast("PipelineSettings", settings).build(start)
    return lambda: cast("LocalizerSettings", settings).build(given.known, start)


def _given_map(options: RunOptions) -> GivenMap | None:
    needed = options.pipeline in LOCALIZERS
    if needed and options.map is None:
        raise UsageError(f"the pipeline '{options.pipeline}' localises in a map: give --map with the folder of a run that made one")
    if not needed and options.map is not None:
        raise UsageError(f"--map: the pipeline '{options.pipeline}' makes its own map; localizers are {', '.join(sorted(LOCALIZERS))}")
    return None if options.map is None else read_given_map(options.map)


def session_of(pipeline: Pipeline, options: RunOptions) -> Resumable:
    """The pipeline, as one that keeps sessions.

    Raises:
        UsageError: it keeps none.
    """
    if not isinstance(pipeline, Resumable):
        raise UsageError(f"--session: the pipeline '{options.pipeline}' keeps no session; take --pipeline lidar_slam")
    return pipeline


def policy_settings(name: str, options: RunOptions, given: GivenMap | None) -> PolicySettings | None:
    """Parameters of the policy that the options name; None: its defaults.

    Raises:
        UsageError: --goal without its policy, or the other way round.
        GoalError: no robot can stand there in the map that is given.
    """
    if (options.goal is not None) != (name == "goal"):
        raise UsageError(f"--goal X Y and --policy goal belong together; the policy is '{name}'")
    if options.goal is not None:
        if not all(map(math.isfinite, options.goal)) or math.hypot(*options.goal) > FARTHEST_START:
            raise UsageError(
                "--goal {:g} {:g}: give finite numbers within {:g} m of the map's origin".format(*options.goal, FARTHEST_START)
            )
        if given is not None:
            check_goal(given.known.grid, options.goal)
        return GoTo(*options.goal)
    return Explore(explorer=Explorer(options.explorer)) if name == "explore" else None


def duration_of(options: RunOptions) -> float:
    """Length of the run [s]; policies that have an end need none.

    Raises:
        UsageError: it is no positive number.
    """
    if options.duration is None:
        return SIMULATED if is_twin(options) and options.policy not in ENDING else math.inf
    if not (math.isfinite(options.duration) and options.duration > 0.0):
        raise UsageError(f"--duration {options.duration:g}: give a positive number of seconds")
    return options.duration
