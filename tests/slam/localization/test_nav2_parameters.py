from pathlib import Path

import pytest

from slam.errors import Nav2ParameterError
from slam.localization.amcl import Amcl
from slam.localization.nav2_parameters import read_nav2

NAV2 = """
/robot1:
  amcl:
    ros__parameters:
      use_sim_time: true
      alpha1: 0.1
      alpha4: 0.3
      alpha5: 0.2
      laser_model_type: "likelihood_field_prob"
      max_beams: 60
      max_particles: 300
      min_particles: 100
      pf_z: 0.99
      recovery_alpha_slow: 0.0
      sigma_hit: 0.2
      z_hit: 0.5
      z_short: 0.05
      update_min_d: 0.25
      do_beamskip: false
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nav2.yaml"
    path.write_text(text)
    return path


def test_parameters_of_nav2_find_their_places_and_the_others_are_named(tmp_path):
    settings, ignored = read_nav2(written(tmp_path, NAV2))
    assert ignored == ("use_sim_time", "alpha5", "do_beamskip")
    assert (settings.odometry.alpha1, settings.odometry.alpha2, settings.odometry.alpha4) == (0.1, Amcl().odometry.alpha2, 0.3)
    assert settings.sensor_model == "likelihood_field"
    assert settings.likelihood_field.sigma_hit == settings.beam.sigma_hit == 0.2
    assert settings.beam.z_short == 0.05
    sizes = settings.filtering.sample_size
    assert (sizes.particles_min, sizes.particles_max, settings.filtering.beams) == (100, 300, 60)
    assert sizes.quantile == pytest.approx(2.326, abs=1e-3)
    assert settings.filtering.augmentation.alpha_slow == 0.0
    assert settings.update.distance == 0.25


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a: [", "not YAML"),
        ("controller_server:\n  ros__parameters: {a: 1}\n", "no ros__parameters of a node 'amcl'"),
        ("amcl:\n  ros__parameters: {sigma_hit: wide}\n", "sigma_hit = 'wide'; must be a number"),
        ("amcl:\n  ros__parameters: {sigma_hit: -1.0}\n", "sigma_hit = -1.0; must be above 0"),
        ("amcl:\n  ros__parameters: {max_particles: 10, min_particles: 50}\n", "must be at least particles_min"),
        ("amcl:\n  ros__parameters: {laser_model_type: magic}\n", "must be one of likelihood_field, likelihood_field_prob, beam"),
    ],
)
def test_what_cannot_be_used_is_said_in_one_line(tmp_path, text, problem):
    with pytest.raises(Nav2ParameterError, match=problem) as caught:
        read_nav2(written(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(Nav2ParameterError, match="cannot be read"):
        read_nav2(tmp_path / "none.yaml")
