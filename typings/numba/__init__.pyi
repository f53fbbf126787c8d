from collections.abc import Callable
from typing import Any

def njit(*, cache: bool = ..., nogil: bool = ..., error_model: str = ...) -> Callable[[Callable[..., Any]], Callable[..., Any]]: ...
