from collections.abc import Sequence

from numpy import floating, integer, uint8
from numpy.typing import NDArray

Vector = Sequence[float]
Pose = tuple[tuple[float, float, float], tuple[float, float, float, float]]

DIRECT: int
GEOM_BOX: int
GEOM_CYLINDER: int
GEOM_MESH: int
GEOM_PLANE: int
ER_BULLET_HARDWARE_OPENGL: int
ER_TINY_RENDERER: int
URDF_IGNORE_VISUAL_SHAPES: int
URDF_USE_INERTIA_FROM_FILE: int
VELOCITY_CONTROL: int

class error(Exception): ...

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
    vertices: Sequence[Vector] = ...,
    physicsClientId: int = ...,
) -> int: ...
def createCollisionShapeArray(
    shapeTypes: Sequence[int],
    halfExtents: Sequence[Vector],
    radii: Sequence[float],
    lengths: Sequence[float],
    collisionFramePositions: Sequence[Vector],
    collisionFrameOrientations: Sequence[Vector],
    physicsClientId: int = ...,
) -> int: ...
def createMultiBody(
    baseMass: float = ...,
    baseCollisionShapeIndex: int = ...,
    baseVisualShapeIndex: int = ...,
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
def getContactPoints(
    bodyA: int = ..., bodyB: int = ..., linkIndexA: int = ..., linkIndexB: int = ..., physicsClientId: int = ...
) -> tuple[tuple[int, int, int, int, int, Vector, Vector, Vector, float, float, float, Vector, float, Vector], ...]: ...
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
def resetBasePositionAndOrientation(bodyUniqueId: int, posObj: Vector, ornObj: Vector, physicsClientId: int = ...) -> None: ...
def getBasePositionAndOrientation(bodyUniqueId: int, physicsClientId: int = ...) -> Pose: ...
def rayTestBatch(
    rayFromPositions: NDArray[floating] | Sequence[Vector],
    rayToPositions: NDArray[floating] | Sequence[Vector],
    numThreads: int = ...,
    collisionFilterMask: int = ...,
    physicsClientId: int = ...,
) -> tuple[tuple[int, int, float, tuple[float, float, float], tuple[float, float, float]], ...]: ...
def createVisualShape(shapeType: int, fileName: str = ..., rgbaColor: Vector = ..., physicsClientId: int = ...) -> int: ...
def changeVisualShape(objectUniqueId: int, linkIndex: int, textureUniqueId: int = ..., physicsClientId: int = ...) -> None: ...
def loadTexture(textureFilename: str, physicsClientId: int = ...) -> int: ...
def loadPlugin(pluginPath: str, postFix: str = ..., physicsClientId: int = ...) -> int: ...
def getCameraImage(
    width: int,
    height: int,
    viewMatrix: Vector = ...,
    projectionMatrix: Vector = ...,
    lightDirection: Vector = ...,
    lightAmbientCoeff: float = ...,
    lightDiffuseCoeff: float = ...,
    lightSpecularCoeff: float = ...,
    shadow: int = ...,
    renderer: int = ...,
    physicsClientId: int = ...,
) -> tuple[int, int, NDArray[uint8], NDArray[floating], NDArray[integer]]: ...
