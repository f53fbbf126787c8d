import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.kernels.frames import into_frame, out_of_frame
from slam.se2 import SE2

poses = st.builds(lambda x, y, yaw: np.array([x, y, yaw]), st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-3.1, 3.1))


@settings(max_examples=50)
@given(pose=poses, frame=poses)
def test_a_pose_in_a_frame_is_that_of_the_transforms(pose: np.ndarray, frame: np.ndarray) -> None:
    within = SE2.from_array(into_frame(pose, frame))
    expected = SE2.from_array(frame).inverse() @ SE2.from_array(pose)
    assert np.allclose((expected.inverse() @ within).log(), 0.0, atol=1e-12)


@settings(max_examples=50)
@given(pose=poses, frame=poses)
def test_the_way_out_of_a_frame_is_the_way_back(pose: np.ndarray, frame: np.ndarray) -> None:
    assert np.allclose(out_of_frame(into_frame(pose, frame), frame), pose, atol=1e-12)
