"""What goes in and comes out of solvers: states, walls, poses, lists. SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import _decant
from ._decant import Scene

Array = np.ndarray

REAL_FIELDS = {
    "boundary_volume": "m^3",
    "density": "kg/m^3",
    "pressure": "Pa",
    "acceleration": "m/s^2",
    "pressure_acceleration": "m/s^2",
    "viscous_acceleration": "m/s^2",
    "wall_pressure_acceleration": "m/s^2",
    "wall_viscous_acceleration": "m/s^2",
}
COUNT_FIELDS = ("fluid_neighbor_count", "fluid_neighbor_id_sum", "wall_neighbor_count", "wall_neighbor_id_sum")


def field_shape(name: str, fluid: int, walls: int) -> tuple[int, ...]:
    """Shape of a field: [walls], [fluid] or [fluid, 3]."""
    if name == "boundary_volume":
        return (walls,)
    return (fluid, 3) if name.endswith("acceleration") else (fluid,)


@dataclass(frozen=True)
class State:
    """Where the fluid is. Row i is particle i, for life; time is substep * scene.time_step."""

    position: Array  # [n,3], m, float64 of fp32 values
    velocity: Array  # [n,3], m/s
    substep: int = 0

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Walls:
    """Wall particles, at rest in the frames of their containers."""

    position: Array  # [m,3], m, in the frame of its container
    container: Array  # [m], int32, not decreasing

    def __len__(self) -> int:
        return len(self.position)


@dataclass(frozen=True)
class Pose:
    """Where a container is: x_world = rotation @ x_local + translation."""

    rotation: Array  # [3,3]
    translation: Array  # [3], m
    pivot: Array  # [3], m, world
    angular_velocity: Array  # [3], rad/s
    linear_velocity: Array  # [3], m/s, of the pivot
    surface_velocity: Array  # [3], m/s, world

    def to_world(self, local: Array) -> Array:
        """Points [...,3], m, of the container's frame in the world."""
        return local @ self.rotation.T + self.translation

    def to_local(self, world: Array) -> Array:
        """Points [...,3], m, of the world in the container's frame."""
        return (world - self.translation) @ self.rotation

    def velocity_at(self, world: Array) -> Array:
        """Velocity [...,3], m/s, of what is solid at points [...,3], m, of the world."""
        return self.linear_velocity + self.surface_velocity + np.cross(self.angular_velocity, world - self.pivot)


@dataclass(frozen=True)
class Given:
    """In place of what a port would compute; None: not given. Pressure comes with density."""

    boundary_volume: Array | None = None  # [m], m^3
    density: Array | None = None  # [n], kg/m^3
    pressure: Array | None = None  # [n], Pa


@dataclass(frozen=True)
class Lists:
    """Neighbor lists: those of particle i are fluid[fluid_offsets[i]:fluid_offsets[i + 1]], in any order.

    A pair of the fluid is in the lists of both its particles.
    """

    built: int  # substep of the state that they were built at
    fluid_offsets: Array  # [n + 1], from 0
    fluid: Array  # ids
    wall_offsets: Array  # [n + 1]
    wall: Array  # numbers of wall particles


@dataclass
class StageTimes:
    """Seconds and timed passes since load, and how often lists were built."""

    build: float = 0.0
    build_calls: int = 0
    density: float = 0.0
    density_calls: int = 0
    force: float = 0.0
    force_calls: int = 0
    integrate: float = 0.0
    integrate_calls: int = 0
    rebuilds: int = 0


def pose(scene: Scene, container: int, time: float) -> Pose:
    """Pose of a container at a time, s. Raises IndexError."""
    return Pose(**scene._pose(container, time))


def walls(scene: Scene) -> Walls:
    """Wall particles of a scene of a file."""
    return Walls(*scene._walls())


def initial_state(scene: Scene) -> State:
    """The fluid at time 0 of a scene of a file."""
    return State(*scene._initial_state())


class Oracle:
    """The sequential reference solver, in double precision, in this process.

    It starts at `state`, or at the scene's beginning.
    """

    def __init__(self, scene: Scene, state: State | None = None):
        self.scene = scene
        self._solver = _decant.Oracle(scene)
        self.load(state if state is not None else initial_state(scene))

    def load(self, state: State) -> None:
        """From another state."""
        position, velocity = (np.ascontiguousarray(x, np.float64) for x in (state.position, state.velocity))
        self._solver.load(position, velocity, state.substep)

    def evaluate(self, given: Given | None = None) -> dict[str, Array]:
        """All fields at the present state (REAL_FIELDS, COUNT_FIELDS), from given density and pressure where given."""
        values = (given.density, given.pressure) if given else (None, None)
        return self._solver.evaluate(*(None if v is None else np.ascontiguousarray(v, np.float64) for v in values))

    def tolerance(self) -> dict[str, Array]:
        """How far each value of a port in fp32 may be off, in the field's unit and shape (oracle/tolerances.md)."""
        return self._solver.tolerance()

    def advance(self, substeps: int = 1) -> None:
        """So many substeps onward. Raises BackendError where a particle leaves the domain or is not finite."""
        self._solver.advance(substeps)

    def read(self) -> State:
        """The present state."""
        return State(*self._solver.read())


Scene.pose = pose
Scene.walls = walls
Scene.initial_state = initial_state
