from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, NamedTuple, TypeAlias, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

Vector: TypeAlias = NDArray[np.float64]
# A function (t, q, v, z, **parameters), a formula, the name of a system, a SymPy expression, or a system.
Lagrangian: TypeAlias = Callable[..., Any] | str | System | SparseSystem | RigidBody | Any
Expression: TypeAlias = str | Callable[..., Any]
Direction: TypeAlias = Literal["both", "rising", "falling"]
Pieces: TypeAlias = Literal["linear", "held", "cubic"]
# A function (t, q, v, z, **parameters), formulas by coordinate, or the formula for a single coordinate.
Force: TypeAlias = Callable[..., Any] | Mapping[str, Expression | float] | str
# Equations, functions c(q, **parameters) that vanish, or a list of them.
Friction: TypeAlias = Mapping[str, Expression | float | tuple[str, Expression | float, Expression | float] | Mapping[str, Expression | float]]
Constraints: TypeAlias = Expression | Sequence[Expression]
Impact: TypeAlias = Literal["elastic"] | tuple[Literal["restitution", "conformal"], float]
# A function (t, q, v, z, **parameters) -> (q, v) or (q, v, z), or formulas by variable.
Reset: TypeAlias = Callable[..., Any] | Mapping[str, Expression | float]
Events: TypeAlias = Expression | Event | Sequence[Expression | Event] | Mapping[str, Expression | Event]

__version__: str

class System:
    def __new__(
        cls,
        lagrangian: str,
        coordinates: Sequence[str],
        parameters: Mapping[str, float] | None = None,
        tables: Sequence[tuple[str, Table]] = ...,
        forces: Sequence[tuple[str, str]] = ...,
        rayleigh: Sequence[str] = ...,
        breaks: Sequence[float] = ...,
        constraints: Sequence[str] = ...,
        friction: Sequence[tuple[str, str, str | None, str | None]] = ...,
        kind: tuple[bool, Sequence[str], str] | None = None,
    ) -> System: ...
    @property
    def lagrangian(self) -> str: ...
    @property
    def coordinates(self) -> list[str]: ...
    @property
    def given_coordinates(self) -> list[str]: ...
    @property
    def parameters(self) -> dict[str, float]: ...
    @property
    def momenta(self) -> list[str]: ...
    @property
    def kind(self) -> tuple[bool, list[str], str]: ...
    @property
    def dimension(self) -> int: ...
    @property
    def structure(self) -> list[str]: ...
    @property
    def used_parameters(self) -> list[str]: ...
    @property
    def symmetries(self) -> list[list[list[int]]]: ...
    @property
    def tables(self) -> list[tuple[str, Table]]: ...
    @property
    def forces(self) -> list[tuple[str, str]]: ...
    @property
    def rayleigh(self) -> list[str]: ...
    @property
    def breaks(self) -> list[float]: ...
    @property
    def constraints(self) -> list[str]: ...
    @property
    def friction(self) -> list[tuple[str, str, str | None, str | None]]: ...
    @property
    def losses(self) -> list[str]: ...
    def with_parameters(self, parameters: Mapping[str, float]) -> System: ...

class Table:
    def __new__(cls, t: ArrayLike, y: ArrayLike, pieces: Pieces = "linear") -> Table: ...
    @property
    def t(self) -> Vector: ...
    @property
    def y(self) -> Vector: ...
    @property
    def pieces(self) -> Pieces: ...
    @property
    def name(self) -> str: ...
    def __call__(self, t: Any) -> Any: ...

class Event:
    when: Expression
    direction: Direction
    terminal: bool
    reset: Reset | None
    impact: Impact | None
    rest: Reset | None
    def __init__(
        self,
        when: Expression,
        direction: Direction = "both",
        terminal: bool = False,
        reset: Reset | None = None,
        impact: Impact | None = None,
        rest: Reset | None = None,
    ) -> None: ...

class Crossings(NamedTuple):
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector

class Resets(NamedTuple):
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    after_q: Vector
    after_v: Vector
    after_p: Vector
    after_z: Vector

class MemberCrossings(NamedTuple):
    member: NDArray[np.int64]
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector

class MemberResets(NamedTuple):
    member: NDArray[np.int64]
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    after_q: Vector
    after_v: Vector
    after_p: Vector
    after_z: Vector

class States(NamedTuple):
    t: Vector | float
    q: Vector
    v: Vector
    p: Vector
    z: Vector | float
    energy: Vector | float

class Plan:
    text: str
    integrator: str
    step: float
    steps: int
    error: float | None

class Solution:
    system: System
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    energy: Vector
    log_factor: Vector | None
    events: list[Crossings | Resets] | dict[str, Crossings | Resets]
    status: str
    success: bool
    unresolved: str | None
    error_estimate: float | None
    steps: int
    evaluations: int
    @property
    def t_end(self) -> float: ...
    @property
    def end(self) -> States: ...
    @property
    def plan(self) -> Plan: ...
    @property
    def momenta(self) -> dict[str, Vector]: ...
    def __getitem__(self, name: str) -> Vector: ...
    def __call__(self, t: ArrayLike) -> States: ...
    def resume(
        self,
        t: ArrayLike | None = None,
        *,
        progress: bool = False,
        callback: Callable[[Solution], Any] | None = None,
        callback_interval: float = 1.0,
    ) -> Solution: ...
    def sensitivity(self, variables: str | Sequence[str]) -> Sensitivity: ...
    def pullback(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        p: ArrayLike | None = None,
        z: ArrayLike | None = None,
    ) -> Gradient: ...
    def lyapunov_exponents(self) -> LyapunovExponents: ...
    def to_xarray(self) -> Any: ...
    def to_pandas(self) -> Any: ...
    def plot(self, *names: str, ax: Any = None) -> Any: ...

class EndSensitivity(NamedTuple):
    q: Vector
    v: Vector
    p: Vector
    z: Vector

class Sensitivity(NamedTuple):
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    growth: float
    t0: float
    event_times: list[Vector] | dict[str, Vector]
    end: EndSensitivity

class Gradient(NamedTuple):
    q0: Vector
    v0: Vector | None
    p0: Vector | None
    z0: float
    parameters: dict[str, float]
    t0: float | None
    t_end: float
    growth: float
    unresolved: str | None = None

class Method:
    function: Callable[..., Any]
    order: int
    name: str
    symmetric: bool

class LyapunovExponents(NamedTuple):
    exponents: Vector
    of_second_half: Vector
    pairs: Vector
    rate: float
    pairing_defect: float | None
    volume_defect: float | None

class EnsembleSensitivity(NamedTuple):
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    growth: Vector
    troubles: dict[int, str]

class EnsembleGradient(NamedTuple):
    q0: Vector
    v0: Vector | None
    p0: Vector | None
    z0: Vector
    parameters: dict[str, Vector]
    t0: Vector
    t_end: Vector
    growth: Vector
    troubles: dict[int, str]

class Fit:
    names: tuple[str, ...]
    x: Vector
    errors: Vector
    at_bounds: dict[str, str]
    covariance: Vector | None
    correlation: Vector | None
    jacobian: Vector
    success: bool
    status: str
    t: dict[str, Vector]
    data: dict[str, Vector]
    fitted: dict[str, Vector]
    residuals: dict[str, Vector]
    cost: float
    residual_variance: float | None
    degrees_of_freedom: int
    rank: int
    iterations: int
    evaluations: int
    system: System
    q0: Vector
    v0: Vector | None
    p0: Vector | None
    z0: float
    step: float
    costs: Vector
    best_start: int
    largest_defect: float | None
    def __getitem__(self, name: str) -> float: ...
    def error(self, name: str) -> float: ...
    def plot_residuals(self, *names: str, ax: Any = None) -> Any: ...

class Path:
    system: System
    t: Vector
    q: Vector
    p: Vector
    z: Vector
    found: bool
    status: str
    residual: float
    log_factor: float
    unresolved: str | None
    error_estimate: float | None
    regularity: float
    iterations: int
    @property
    def action(self) -> float: ...
    def __getitem__(self, name: str) -> Vector: ...
    def to_pandas(self) -> Any: ...
    def to_xarray(self) -> Any: ...
    def plot(self, *names: str, ax: Any = None) -> Any: ...
    def __bool__(self) -> bool: ...

class SparseSystem:
    dimension: int
    shape: tuple[int, ...]
    parameters: dict[str, float]
    @property
    def system(self) -> System: ...
    def with_parameters(self, parameters: Mapping[str, float]) -> SparseSystem: ...

class SparseSolution:
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    energy: Vector
    log_factor: Vector | None
    status: str
    success: bool
    unresolved: str | None
    steps: int
    evaluations: int
    @property
    def t_end(self) -> float: ...
    @property
    def end(self) -> States: ...
    @property
    def momenta(self) -> dict[str, Vector]: ...
    def resume(
        self,
        t: ArrayLike | None = None,
        *,
        progress: bool = False,
        callback: Callable[[SparseSolution], Any] | None = None,
        callback_interval: float = 1.0,
    ) -> SparseSolution: ...
    def __getitem__(self, name: str) -> Vector: ...
    def to_pandas(self) -> Any: ...
    def to_xarray(self) -> Any: ...
    def plot(self, *names: str, ax: Any = None) -> Any: ...

class RigidBodyStates:
    t: Vector
    attitude: Vector
    Pi: Vector
    omega: Vector
    M: Vector
    tip: Vector
    energy: Vector
    z: Vector
    def __getitem__(self, name: str) -> Vector: ...
    def to_pandas(self) -> Any: ...
    def to_xarray(self) -> Any: ...
    def plot(self, *names: str, ax: Any = None) -> Any: ...

class RigidBodyDerivatives:
    in_attitude: Vector
    in_omega: Vector
    in_z: Vector
    in_parameters: dict[str, Vector]
    log_factor: float
    contact_defect: float

class RigidBodySensitivity(NamedTuple):
    turn: Vector
    attitude: Vector
    Pi: Vector
    omega: Vector
    M: Vector
    tip: Vector
    energy: Vector
    z: Vector
    growth: float
    event_times: list[Vector]
    end: RigidBodySensitivity | None

class RigidBody:
    def with_parameters(self, parameters: Mapping[str, Any]) -> RigidBody: ...

class RigidBodySolution(RigidBodyStates):
    end: RigidBodyStates
    events: list[RigidBodyStates]
    status: str
    success: bool
    integrator: str
    step_size: float
    steps: int
    error_estimate: float | None
    derivatives: RigidBodyDerivatives | None
    @property
    def t_end(self) -> float: ...
    @property
    def plan(self) -> Plan: ...
    def __call__(self, t: ArrayLike) -> RigidBodyStates: ...
    def resume(
        self,
        t: ArrayLike | None = None,
        *,
        progress: bool = False,
        callback: Callable[[RigidBodySolution], Any] | None = None,
        callback_interval: float = 1.0,
    ) -> RigidBodySolution: ...
    def sensitivity(self, variables: str | Sequence[str]) -> RigidBodySensitivity: ...
    def pullback(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        p: ArrayLike | None = None,
        z: ArrayLike | None = None,
    ) -> Gradient: ...

class Interrupted(KeyboardInterrupt):
    solution: Solution | SparseSolution | RigidBodySolution | Ensemble
    def __init__(self, solution: Solution | SparseSolution | RigidBodySolution | Ensemble) -> None: ...

class Ensemble:
    system: System
    t: Vector
    q: Vector
    v: Vector
    p: Vector
    z: Vector
    times: Vector | None
    events: list[MemberCrossings | MemberResets] | dict[str, MemberCrossings | MemberResets]
    steps: NDArray[np.int64]
    success: NDArray[np.bool_]
    troubles: dict[int, str]
    batch_kernel: int
    own_plans: int
    def __len__(self) -> int: ...
    def __getitem__(self, name: str) -> Vector: ...
    def sensitivity(self, variables: str | Sequence[str]) -> EnsembleSensitivity: ...
    def pullback(
        self,
        q: ArrayLike | None = None,
        v: ArrayLike | None = None,
        p: ArrayLike | None = None,
        z: ArrayLike | None = None,
    ) -> EnsembleGradient: ...
    def to_pandas(self) -> Any: ...
    def to_xarray(self) -> Any: ...
    def plot(self, coordinate: int | str = 0, ax: Any = None) -> Any: ...

class Geometry(NamedTuple):
    lagrangian: float
    momentum: Vector
    energy: float
    rate: float
    mass: Vector
    condition: float
    eta: Vector
    reeb: Vector
    volume: float
    herglotz_field: Vector

class HamiltonianGeometry(NamedTuple):
    hamiltonian: float
    velocity: Vector
    rate: float
    hessian: Vector
    condition: float
    eta: Vector
    reeb: Vector
    field: Vector
    lie_derivative: Vector
    brackets: Vector

class Contact(NamedTuple):
    is_contact: bool
    sigma: float
    defect: float
    image: Vector
    jacobian: Vector
    def __bool__(self) -> bool: ...

class Exponential(NamedTuple):
    q1: Vector
    regularity: float

class Retraction(NamedTuple):
    v0: Vector
    v1: Vector
    z1: float
    action: float
    sigma: float

class DiscreteLagrangian(NamedTuple):
    value: float
    d1: Vector
    d2: Vector
    dz: float
    sigma: float

class Place(NamedTuple):
    t: float
    sigma: float
    log_factor: float
    contact_defect: float
    herglotz_defect: float
    momenta: list[tuple[float, float]]

class Check(NamedTuple):
    is_contact: bool
    integrator: str
    step: float
    places: list[Place]
    statements: list[tuple[str, str, float]]
    losses: list[str]
    def __bool__(self) -> bool: ...

class Work(NamedTuple):
    integrator: str
    order: int
    step: float
    steps: int
    evaluations: int
    error: float
    seconds: float

class Comparison:
    rows: list[Work]
    reference: str
    left_out: dict[str, str]
    losses: list[str]
    def best(self, error: float) -> Work | None: ...
    def to_pandas(self) -> Any: ...
    def plot(self, ax: Any = None) -> Any: ...

def system(
    L: Lagrangian | None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    H: Expression | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
    n: int | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
    breaks: Sequence[float] | None = None,
    constraints: Constraints | None = None,
    friction: Friction | None = None,
) -> System: ...
def solve(
    L: Lagrangian | None = None,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    H: Expression | None = None,
    p0: ArrayLike | None = None,
    z0: float = 0.0,
    accuracy: float | None = None,
    integrator: str | Method | None = None,
    step: float | None = None,
    steps: int | None = None,
    every: int | None = None,
    events: Events = (),
    observe: Mapping[str, Expression] | None = None,
    conformal_factor: bool = False,
    estimate: bool = False,
    exact: bool = False,
    scales: ArrayLike | None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
    breaks: Sequence[float] | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
    constraints: Constraints | None = None,
    friction: Friction | None = None,
    project: bool = False,
    progress: bool = False,
    callback: Callable[[Solution], Any] | None = None,
    callback_interval: float = 1.0,
) -> Solution: ...
def lattice(
    site: str,
    bond: str | None = None,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    p0: ArrayLike | None = None,
    z0: float = 0.0,
    sites: int | Sequence[int] | None = None,
    boundary: Literal["periodic", "fixed", "free"] = "periodic",
    integrator: str = "strang",
    step: float | None = None,
    steps: int | None = None,
    every: int | None = None,
    conformal_factor: bool = False,
    coordinates: Sequence[str] | str = ("x",),
    parameters: Mapping[str, float] | None = None,
    progress: bool = False,
    callback: Callable[[SparseSolution], Any] | None = None,
    callback_interval: float = 1.0,
) -> Any: ...
def bodies(
    masses: ArrayLike,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    p0: ArrayLike | None = None,
    dimensions: Literal[2, 3] | None = None,
    G: float = 1.0,
    gamma: float = 0.0,
    z0: float = 0.0,
    integrator: str = "blanes_moan_6",
    step: float | None = None,
    steps: int | None = None,
    every: int | None = None,
    conformal_factor: bool = False,
    progress: bool = False,
    callback: Callable[[SparseSolution], Any] | None = None,
    callback_interval: float = 1.0,
) -> Any: ...
def body(
    inertia: ArrayLike,
    *,
    mass: float = 0.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    gamma: float = 0.0,
    torque: Sequence[str | float] | None = None,
) -> RigidBody: ...
def rigid_body(
    inertia: ArrayLike,
    *,
    mass: float = 0.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    gamma: float = 0.0,
    torque: Sequence[str | float] | None = None,
    attitude: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    omega: ArrayLike | None = None,
    z0: float = 0.0,
    t: ArrayLike | None = None,
    accuracy: float | None = None,
    integrator: str | None = None,
    step: float | None = None,
    steps: int | None = None,
    every: int | None = None,
    events: str | Event | Sequence[str | Event] = (),
    sensitivity: bool = False,
    progress: bool = False,
    callback: Callable[[RigidBodySolution], Any] | None = None,
    callback_interval: float = 1.0,
) -> RigidBodySolution: ...
def run(
    scene: str | PathLike[str],
    changes: Mapping[str, float | str] | None = None,
    *,
    progress: bool = False,
    callback: Callable[[Any], Any] | None = None,
    callback_interval: float = 1.0,
) -> Any: ...
def rigid_body_between(
    inertia: ArrayLike,
    *,
    mass: float = 0.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    gamma: float = 0.0,
    torque: Sequence[str | float] | None = None,
    attitude: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    to: ArrayLike | None = None,
    omega: ArrayLike | None = None,
    z0: float = 0.0,
    t: ArrayLike | None = None,
    integrator: str = "gauss_4",
    step: float | None = None,
    steps: int | None = None,
) -> RigidBodySolution: ...
def rigid_bodies(
    inertia: ArrayLike,
    *,
    mass: ArrayLike = 0.0,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    gravity: ArrayLike = (0.0, 0.0, 0.0),
    gamma: ArrayLike = 0.0,
    torque: Sequence[str | float] | None = None,
    attitude: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    omega: ArrayLike | None = None,
    z0: ArrayLike = 0.0,
    t: ArrayLike | None = None,
    accuracy: float | None = None,
    integrator: str | None = None,
    step: float | None = None,
    steps: int | None = None,
    threads: int | None = None,
) -> list[RigidBodySolution]: ...
def ensemble(
    L: Lagrangian | None = None,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    H: Expression | None = None,
    p0: ArrayLike | None = None,
    z0: ArrayLike = 0.0,
    accuracy: float | None = None,
    integrator: str | None = None,
    step: float | None = None,
    steps: int | None = None,
    events: Events = (),
    observe: Mapping[str, Expression] | None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    threads: int | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
    breaks: Sequence[float] | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
    constraints: Constraints | None = None,
    progress: bool = False,
) -> Ensemble: ...
@overload
def geometry(
    L: Lagrangian,
    t: float,
    q: ArrayLike,
    v: ArrayLike,
    z: float = 0.0,
    *,
    H: None = None,
    p: None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    momenta: None = None,
    action: str | None = None,
) -> Geometry: ...
@overload
def geometry(
    L: System | None = None,
    t: float = 0.0,
    q: ArrayLike | None = None,
    v: None = None,
    z: float = 0.0,
    *,
    H: Expression | None = None,
    p: ArrayLike,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
) -> HamiltonianGeometry: ...
def value_and_grad(loss: Expression) -> Callable[..., tuple[float, Gradient]]: ...
def ensemble_value_and_grad(loss: Expression) -> Callable[..., tuple[Vector, EnsembleGradient]]: ...
def fit(
    L: Lagrangian | None = None,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    data: Mapping[str, ArrayLike] | None = None,
    unknowns: Sequence[str] | None = None,
    *,
    events: Mapping[str, tuple[Event | Expression, ArrayLike]] | None = None,
    t0: float | None = None,
    sigma: float | Mapping[str, ArrayLike] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    absolute_sigma: bool = False,
    loss: tuple[str, float] | None = None,
    nodes: ArrayLike = (),
    starts: Sequence[Mapping[str, float]] = (),
    max_evaluations: int | None = None,
    H: Expression | None = None,
    p0: ArrayLike | None = None,
    z0: float = 0.0,
    accuracy: float | None = None,
    integrator: str | None = None,
    step: float | None = None,
    steps: int | None = None,
    scales: ArrayLike | None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
    breaks: Sequence[float] | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
    constraints: Constraints | None = None,
    friction: Friction | None = None,
    project: bool = False,
) -> Fit: ...
def path(
    L: Lagrangian,
    q0: ArrayLike,
    q1: ArrayLike,
    t: float | tuple[float, float],
    *,
    steps: int,
    integrator: str = "gauss_4",
    z0: float = 0.0,
    guess: ArrayLike | None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
) -> Path: ...
def is_contact(
    map: Callable[[Any, Any, Any], tuple[Any, Any, Any]],
    at: tuple[ArrayLike, ArrayLike, float],
    *,
    tolerance: float = 1e-9,
) -> Contact: ...
def method(
    function: Callable[..., Any], order: int, *, name: str | None = None, symmetric: bool = False
) -> Method: ...
def check(
    L: Lagrangian | None = None,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    H: Expression | None = None,
    p0: ArrayLike | None = None,
    z0: float = 0.0,
    places: int = 10,
    accuracy: float | None = None,
    integrator: str | Method | None = None,
    step: float | None = None,
    steps: int | None = None,
    events: Events = (),
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
    breaks: Sequence[float] | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
    constraints: Constraints | None = None,
) -> Check: ...
def compare(
    L: Lagrangian | None = None,
    q0: ArrayLike | None = None,
    v0: ArrayLike | None = None,
    t: ArrayLike | None = None,
    *,
    H: Expression | None = None,
    p0: ArrayLike | None = None,
    z0: float = 0.0,
    method: Method | None = None,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
    force: Force | None = None,
    rayleigh: Expression | None = None,
    tables: Mapping[str, Table] | None = None,
    breaks: Sequence[float] | None = None,
    momenta: Sequence[str] | str | None = None,
    action: str | None = None,
    constraints: Constraints | None = None,
    friction: Friction | None = None,
) -> Comparison: ...
def table(t: ArrayLike, y: ArrayLike, pieces: Pieces = "linear") -> Table: ...
def where(condition: Any, x: Any, y: Any) -> Any: ...
def array(values: Any) -> Any: ...
def integrators() -> dict[str, int]: ...
def catalogue() -> dict[str, str]: ...
def exponential(
    L: Lagrangian,
    h: float,
    q0: ArrayLike,
    v0: ArrayLike,
    z0: float = 0.0,
    t: float = 0.0,
    *,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Exponential: ...
def retract(
    L: Lagrangian,
    h: float,
    q0: ArrayLike,
    q1: ArrayLike,
    z0: float = 0.0,
    t: float = 0.0,
    *,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
) -> Retraction: ...
def exact_lagrangian(
    L: Lagrangian,
    h: float,
    q0: ArrayLike,
    q1: ArrayLike,
    z0: float = 0.0,
    t: float = 0.0,
    *,
    coordinates: Sequence[Any] | str | None = None,
    parameters: Mapping[str, float] | None = None,
) -> DiscreteLagrangian: ...
