"""`amcl` from the parameters of nav2's node of that name: what a ROS user has at hand."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import yaml

from slam.errors import Nav2ParameterError, ParameterError
from slam.localization.amcl import Amcl
from slam.localization.resampling import quantile_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Value = bool | int | float | str
Settings = TypeVar("Settings", bound="DataclassInstance")

_MODELS = {"likelihood_field": "likelihood_field", "likelihood_field_prob": "likelihood_field", "beam": "beam"}
_BOTH = {"z_hit": "z_hit", "z_rand": "z_rand", "sigma_hit": "sigma_hit"}
_PLACES: dict[str, tuple[str, ...]] = {
    "min_particles": ("filtering.sample_size.particles_min",),
    "max_particles": ("filtering.sample_size.particles_max",),
    "pf_err": ("filtering.sample_size.error",),
    "pf_z": ("filtering.sample_size.quantile",),
    "alpha1": ("odometry.alpha1",),
    "alpha2": ("odometry.alpha2",),
    "alpha3": ("odometry.alpha3",),
    "alpha4": ("odometry.alpha4",),
    "laser_model_type": ("sensor_model",),
    **{name: (f"likelihood_field.{ours}", f"beam.{ours}") for name, ours in _BOTH.items()},
    "z_short": ("beam.z_short",),
    "z_max": ("beam.z_max",),
    "lambda_short": ("beam.lambda_short",),
    "laser_likelihood_max_dist": ("likelihood_field.max_distance",),
    "max_beams": ("filtering.beams",),
    "update_min_d": ("update.distance",),
    "update_min_a": ("update.yaw",),
    "recovery_alpha_slow": ("filtering.augmentation.alpha_slow",),
    "recovery_alpha_fast": ("filtering.augmentation.alpha_fast",),
}
"""nav2's name -> where the value goes."""


def read_nav2(path: Path) -> tuple[Amcl, tuple[str, ...]]:
    """Settings from a ROS parameter file, and the names of the parameters in it that mean nothing here, in order.

    Raises:
        Nav2ParameterError: the file cannot be read, has no parameters of `amcl`, or one with a wrong value.
    """
    try:
        content: object = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise Nav2ParameterError(path, f"cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise Nav2ParameterError(path, f"not YAML: {' '.join(str(error).split())}") from error
    parameters = _of_amcl(content, within=False)
    if parameters is None:
        raise Nav2ParameterError(path, "no ros__parameters of a node 'amcl'")
    try:
        return from_nav2(parameters)
    except (ParameterError, ValueError) as error:
        raise Nav2ParameterError(path, str(error)) from error


def from_nav2(parameters: Mapping[str, object]) -> tuple[Amcl, tuple[str, ...]]:
    """Settings from nav2's parameters by name, and the names of those that mean nothing here.

    What is not given keeps this project's default, not nav2's.

    Raises:
        ParameterError, ValueError: a value that nothing can be done with.
    """
    settings, ignored = Amcl(), list[str]()
    particles = settings.filtering.sample_size
    most = max(int(_number("max_particles", parameters.get("max_particles", particles.particles_max))), 1)
    sizes = dataclasses.replace(particles, particles_min=min(particles.particles_min, most), particles_max=most)
    settings = dataclasses.replace(settings, filtering=dataclasses.replace(settings.filtering, sample_size=sizes))
    for name, value in parameters.items():
        if name not in _PLACES:
            ignored.append(name)
            continue
        taken = _CONVERTED.get(name, _number)(name, value)
        for place in _PLACES[name]:
            settings = _with(settings, place.split("."), taken)
    return settings, tuple(ignored)


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{name} = {value!r}; must be a number")
    return value


def _model(name: str, value: object) -> str:
    if value not in _MODELS:
        raise ValueError(f"{name} = {value!r}; must be one of {', '.join(_MODELS)}")
    return _MODELS[str(value)]


def _quantile(name: str, value: object) -> float:
    """nav2 means a quantile and everybody gives it the probability, 0.99."""
    number = _number(name, value)
    return quantile_of(number) if 0.5 < number < 1.0 else number


_CONVERTED: dict[str, Callable[[str, object], Value]] = {"laser_model_type": _model, "pf_z": _quantile}


def _with(settings: Settings, place: list[str], value: Value) -> Settings:
    """The dataclass with one field, named by the way to it, replaced."""
    name, *rest = place
    changed: dict[str, Any] = {name: _with(getattr(settings, name), rest, value) if rest else value}
    return dataclasses.replace(settings, **changed)


def _of_amcl(tree: object, within: bool) -> Mapping[str, object] | None:
    """The parameters of the node `amcl`, under any namespace; of a file that holds nothing else, all of them."""
    if not isinstance(tree, dict):
        return None
    nodes = cast("dict[object, object]", tree)
    if within and isinstance(nodes.get("ros__parameters"), dict):
        return cast("Mapping[str, object]", nodes["ros__parameters"])
    for name, node in nodes.items():
        found = _of_amcl(node, within or str(name).rsplit("/", 1)[-1] in ("amcl", "**", "*"))
        if found is not None:
            return found
    return None
