from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

class EmbreeScene:
    def __init__(self, device: object = ..., robust: bool = ...) -> None: ...
    @overload
    def run(
        self,
        vec_origins: NDArray[np.float32],
        vec_directions: NDArray[np.float32],
        dists: float | NDArray[np.float32] | None = ...,
        query: Literal["DISTANCE"] = ...,
    ) -> NDArray[np.float32]: ...
    @overload
    def run(
        self,
        vec_origins: NDArray[np.float32],
        vec_directions: NDArray[np.float32],
        dists: float | NDArray[np.float32] | None,
        query: Literal["INTERSECT"],
    ) -> NDArray[np.int32]: ...
