"""The deformed finger as a picture: triangles with fields at their corners, outlines, and stills of a load path."""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from solver.arrays import Array, Indices
from solver.body import Probes
from solver.body.finite import FiniteBody
from solver.body.linear import Elastic
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import LinearFinger, finite_laws, settled_moduli
from solver.equilibrium.load_path import SMALL_STEPS, Instant, apply_loading, undeformed_path
from solver.failures import SolveFailure
from solver.mesh import Q2P1, Mesh, local_coordinates
from solver.mesh.mesher import Outline
from solver.prediction import Prediction, Skin, SkinLine
from solver.progress import Progress, report_part
from solver.quantities import FIELDS, SED
from solver.response import skin_of
from solver.scene import Scene

# Eight triangles of each element, in its nine nodes
_AROUND = [0, 4, 1, 5, 2, 6, 3, 7]  # the nodes along the sides of an element
_SPLIT = np.array([[8, 0, 4], [8, 4, 1], [8, 1, 5], [8, 5, 2], [8, 2, 6], [8, 6, 3], [8, 3, 7], [8, 7, 0]])
DISPLACEMENT = "displacement"  # name of a field: distance by which a node moved relative to the bone [mm]
_INSIDE = float(Q2P1.points.max())  # local coordinate of the outermost quadrature point [-]


@dataclass(frozen=True, slots=True, eq=False)
class Fields:
    """A picture in the world frame: the surface is y = 0, the finger above it is pressed and dragged."""

    nodes: Array  # (n, 2) deformed positions [mm]; a node between layers appears once for each
    triangles: Indices  # (t, 3)
    values: Mapping[str, Array]  # (n,) `FIELDS`, averaged over the elements of one layer at the node; `DISPLACEMENT`
    outlines: Mapping[str, Array]  # "skin", "epidermis", "dermis", "bone": (m, 2) deformed lines [mm]
    patch: Array  # (m, 2) outline of the reference ending, deformed [mm]

    @property
    def sed(self) -> Array:
        """SED at the nodes (n,) [MPa]."""
        return self.values[SED.name]


@dataclass(frozen=True, slots=True, eq=False)
class Sketch:
    """The data that all pictures of one finger on one mesh share."""

    mesh: Mesh
    triangles: Indices  # (t, 3) of the nodes of the picture
    elements: Indices  # (e, 8) of the picture's nodes, along the sides of each element
    region: Indices  # (t,) number of the material of each triangle
    skin: SkinLine
    probes: Probes  # at the nodes of every element, one element after the other
    elastic: Elastic
    _nodes: Indices  # (n,) node of the mesh for each node of the picture
    _place: Indices  # (e, 9) node of the picture for each node of an element
    _lines: Mapping[str, tuple[Indices, Array]]  # element (m,) and shape functions (m, 9) of the lines that move
    _bone: Array  # (m, 2) undeformed [mm]

    @staticmethod
    def of(mesh: Mesh, scene: Scene) -> "Sketch":
        """Prepare to draw the finger of `scene`."""
        count = len(mesh.elements)
        # one node for each pair of node and layer
        pairs = mesh.elements + len(mesh.nodes) * mesh.region[:, None]
        nodes, place = np.unique(pairs, return_inverse=True)
        place = place.reshape(count, 9)
        elastic = Elastic.of(mesh, settled_moduli(scene.materials))
        outline = Outline.of(scene.finger)
        arcs = np.linspace(outline.palmar_cut, outline.dorsal_cut, 241)
        skin = scene.finger.epidermis
        depths = {"skin": 0.0, "epidermis": skin, "dermis": skin + scene.finger.dermis}
        lines = {name: outline.tissue(arcs, np.asarray(depth)) for name, depth in depths.items()}
        lines["patch"] = _patch(outline, scene)
        places = {name: _locate(mesh, line) for name, line in lines.items()}
        element, shape = places["skin"]
        return Sketch(
            mesh=mesh,
            triangles=place[:, _SPLIT].reshape(-1, 3),
            elements=place[:, _AROUND],
            region=np.repeat(mesh.region, len(_SPLIT)),
            skin=SkinLine(arcs, place[element], shape),
            probes=Probes.at(mesh, elastic.centre, np.repeat(np.arange(count), 9), np.tile(Q2P1.positions, (count, 1))),
            elastic=elastic,
            _nodes=nodes % len(mesh.nodes),
            _place=place,
            _lines=places,
            _bone=outline.bone(arcs),
        )

    def values(self, displacement: Array) -> Array:
        """Return `FIELDS` at the nodes of every element (f, 9 e, m) for displacements (nodes, 2, m), small strain."""
        state = self.elastic.state(self.elastic.probe_data(self.probes), displacement)
        return np.stack([field.small(state) for field in FIELDS])

    def fields(self, displacement: Array, indentation: float, values: Array) -> Fields:
        """Return the picture of displacements (nodes, 2) [mm] relative to the bone, with `values` (f, 9 e) of them."""
        position = self.mesh.nodes + displacement - [0.0, indentation]
        place = self._place.ravel()
        count = np.bincount(place)
        means = {field.name: np.bincount(place, value) / count for field, value in zip(FIELDS, values, strict=True)}
        means[DISPLACEMENT] = np.hypot(*displacement[self._nodes].T)
        curves = {
            name: (shape[:, None] @ self.mesh.local(position, element))[:, 0]
            for name, (element, shape) in self._lines.items()
        }
        patch = curves.pop("patch")
        bone = self._bone - [0.0, indentation]
        return Fields(position[self._nodes], self.triangles, means, curves | {"bone": bone}, patch)


def fields_of(prediction: Prediction, sketch: Sketch | None = None) -> Fields:
    """Return the picture of `prediction`; `sketch` is the sketch of its mesh, if it exists."""
    sketch = sketch or Sketch.of(prediction.mesh, prediction.scene)
    return sketch.fields(prediction.displacement, prediction.indentation, _values(prediction, sketch))


def _values(prediction: Prediction, sketch: Sketch) -> Array:
    """Return `FIELDS` at the nodes of every element, one element after the other (f, 9 e)."""
    scene = prediction.scene
    if scene.solve.kinematics == "small":
        return sketch.values(prediction.displacement[:, :, None])[:, :, 0]
    body = FiniteBody.of(prediction.mesh, finite_laws(scene.materials), checked=True)

    def values(probes: Probes) -> Array:
        with np.errstate(invalid="ignore", divide="ignore"):  # a node turned inside out has no energy
            state = body.state(body.probe_data(probes), prediction.displacement)
            return np.stack([field.finite(state) for field in FIELDS])

    fields = values(sketch.probes)
    sound = np.isfinite(fields).all(axis=0)
    if sound.all():
        return fields
    # In a sharp corner, such as where bone ends at the skin, det F may be negative at a node of an element although it
    # is positive at all quadrature points. The nearest of these then represents the node.
    points = np.tile(_INSIDE * Q2P1.positions, (len(sketch.mesh.elements), 1))
    return np.where(sound, fields, values(Probes.at(sketch.mesh, sketch.elastic.centre, sketch.probes.element, points)))


def _patch(outline: Outline, scene: Scene) -> Array:
    """Return the undeformed outline of the reference ending (m, 2) [mm]."""
    receptor = scene.receptor
    across, along = receptor.ending
    arc = outline.along(0.0, receptor.depth, np.linspace(-along / 2, along / 2, 11))
    near, far = (outline.tissue(arc, np.asarray(receptor.depth + side * across / 2)) for side in (-1, 1))
    return np.concatenate([near, far[::-1], near[:1]])


def _locate(mesh: Mesh, points: Array) -> tuple[Indices, Array]:
    """Return the element (m,) that holds each undeformed point (m, 2), and its shape functions there (m, 9)."""
    element = _elements_at(mesh, points)
    local = local_coordinates(mesh.local(mesh.nodes, element), points, np.zeros(points.shape))
    return element, Q2P1.shape(local)[0]


def _elements_at(mesh: Mesh, points: Array) -> Indices:
    """Return the element (m,) that holds each point, or the element nearest to it in local coordinates."""
    centres = mesh.nodes[mesh.elements[:, 8]]
    near = np.argsort(np.sum((points[:, None] - centres) ** 2, axis=2), axis=1)[:, :12]
    candidates = near.ravel()
    corners = mesh.local(mesh.nodes, candidates)
    local = local_coordinates(corners, np.repeat(points, near.shape[1], axis=0), np.zeros((len(candidates), 2)))
    outside = np.abs(local).max(axis=1).reshape(near.shape)
    return near[np.arange(len(points)), np.argmin(np.where(np.isfinite(outside), outside, np.inf), axis=1)]


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """One state of a load path, at small strain."""

    instant: Instant
    fields: Fields
    skin: Skin
    row: Array  # (r,) SED of the row of receptors [MPa]
    sed: float  # averaged over the ending [MPa]


def stills(finger: LinearFinger, instants: Sequence[Instant], sketch: Sketch) -> tuple[Still, ...]:
    """Return the pictures of states of `finger`, on load paths along which no tissue relaxes."""
    displacement = finger.body.displacement(np.stack([instant.state.u for instant in instants], axis=2))
    values = sketch.values(displacement)
    rows = finger.row.average(displacement)
    ending = finger.ending.average(displacement)[0]
    return tuple(
        Still(
            instant,
            sketch.fields(displacement[:, :, number], instant.depth, values[:, :, number]),
            skin_of(finger, instant.state),
            rows[:, number],
            float(ending[number]),
        )
        for number, instant in enumerate(instants)
    )


def path_until_failure(
    scene: Scene, finger: LinearFinger, progress: Progress | None = None
) -> tuple[tuple[Instant, ...], SolveFailure | None]:
    """Return the states from first touch on, and the failure if they end before the finger settles.

    They end before tissue folds: later states solve the equations of small strain, but no finger has them. Raises
    Cancelled where `progress` says so.
    """
    path = undeformed_path(scene, finger)
    try:
        apply_loading(path, finger, scene.loading_per_mm, SMALL_STEPS, 1.0, lambda _, part: report_part(progress, part))
    except SolveFailure as failure:
        return _before_folding(finger, path.instants), failure
    return tuple(path.instants), None


def _before_folding(finger: LinearFinger, instants: Sequence[Instant]) -> tuple[Instant, ...]:
    """Return the states before the first in which tissue is inside out; folded tissue stays folded."""

    def folds(instant: Instant) -> bool:
        return finger.body.smallest_det(finger.displacement(instant.state)) <= 0.0

    return tuple(instants[: max(bisect_left(instants, True, key=folds), 1)])


def place_of_least_stretch(finger: LinearFinger, state: EquilibriumState, depth: float) -> tuple[float, float]:
    """Return the position [mm] of the most compressed tissue, the corner with the least stretch, in the world frame."""
    displacement = finger.displacement(state)
    mesh = finger.geometry.mesh
    corner = int(np.argmin(finger.body.stretches(displacement)[0]))
    node = mesh.elements[corner // 4, corner % 4]
    x, y = mesh.nodes[node] + displacement[node]
    return float(x), float(y - depth)
