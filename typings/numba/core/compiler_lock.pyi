from types import TracebackType

class _CompilerLock:
    def __enter__(self) -> None: ...
    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None: ...

global_compiler_lock: _CompilerLock
