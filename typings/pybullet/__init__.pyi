from collections.abc import Sequence

from numpy import floating
from numpy.typing import NDArray

Vector = Sequence[float]
Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]

DIRECT: int
GEOM_BOX: int
GEOM_CYLINDER: int
GEOM_PLANE: int
URDF_IGNORE_VISUAL_SHAPES: int
URDF_USE_INERTIA_FROM_FILE: int
VELOCITY_CONTROL: int

class error(Exception): ...  # noqa: N801, N818 - PyBullet's name

def connect(method: int) -> int: ...
def disconnect(physicsClientId: int = ...) -> None: ...
def isConnected(physicsClientId: int = ...) -> int: ...
def setGravity(gravX: float, gravY: float, gravZ: float, physicsClientId: int = ...) -> None: ...
def setPhysicsEngineParameter(
    *, fixedTimeStep: float = ..., numSolverIterations: int = ..., deterministicOverlappingPairs: int = ..., physicsClientId: int = ...
) -> None: ...
def stepSimulation(physicsClientId: int = ...) -> None: ...
def createCollisionShape(
    shapeType: int,
    radius: float = ...,
    halfExtents: Vector = ...,
    height: float = ...,
    physicsClientId: int = ...,
) -> int: ...
def createMultiBody(
    baseMass: float = ...,
    baseCollisionShapeIndex: int = ...,
    basePosition: Vector = ...,
    baseOrientation: Vector = ...,
    useMaximalCoordinates: int = ...,
    physicsClientId: int = ...,
) -> int: ...
def loadURDF(
    fileName: str, basePosition: Vector = ..., baseOrientation: Vector = ..., flags: int = ..., physicsClientId: int = ...
) -> int: ...
def changeDynamics(
    bodyUniqueId: int,
    linkIndex: int,
    lateralFriction: float = ...,
    linearDamping: float = ...,
    angularDamping: float = ...,
    jointDamping: float = ...,
    physicsClientId: int = ...,
) -> None: ...
def getDynamicsInfo(
    bodyUniqueId: int, linkIndex: int, physicsClientId: int = ...
) -> tuple[float, float, tuple[float, ...], tuple[float, ...], tuple[float, ...], float, float, float, float, float, int, float]: ...
def setCollisionFilterGroupMask(
    bodyUniqueId: int, linkIndexA: int, collisionFilterGroup: int, collisionFilterMask: int, physicsClientId: int = ...
) -> None: ...
def getNumJoints(bodyUniqueId: int, physicsClientId: int = ...) -> int: ...
def getJointInfo(
    bodyUniqueId: int, jointIndex: int, physicsClientId: int = ...
) -> tuple[int, bytes, int, int, int, int, float, float, float, float, float, float, bytes, Vector, Vector, Vector, int]: ...
def getJointStates(
    bodyUniqueId: int, jointIndices: Sequence[int], physicsClientId: int = ...
) -> tuple[tuple[float, float, tuple[float, ...], float], ...]: ...
def setJointMotorControlArray(
    bodyUniqueId: int,
    jointIndices: Sequence[int],
    controlMode: int,
    targetVelocities: Vector = ...,
    forces: Vector = ...,
    physicsClientId: int = ...,
) -> None: ...
def getBasePositionAndOrientation(bodyUniqueId: int, physicsClientId: int = ...) -> Pose: ...
def rayTestBatch(
    rayFromPositions: NDArray[floating] | Sequence[Vector],
    rayToPositions: NDArray[floating] | Sequence[Vector],
    numThreads: int = ...,
    collisionFilterMask: int = ...,
    physicsClientId: int = ...,
) -> tuple[tuple[int, int, float, tuple[float, float, float], tuple[float, float, float]], ...]: ...
