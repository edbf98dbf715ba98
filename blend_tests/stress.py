# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes badly made scenes of Blender, for the second part of the table in docs/stability.md.

    blender -b --factory-startup --python-exit-code 1 -P blend_tests/stress.py -- \\
        [--quick] [--only TEXT]

`native/stress/stability` runs this script after its own cases, which build scenes without Blender.
Here Blender evaluates transforms, modifiers and instances. Most scenes are in a white furnace: the
world has radiance 1 / pi, and both sides of all surfaces emit what they do not reflect, so that the
irradiance is 1 W/m^2 on every surface, whatever its shape. The columns are:

    largest    largest relative deviation of the irradiance at the corners from the exact answer
    RMS        relative RMS deviation of the means of the faces, by area: at most 1.25 times the
               error that the report states (or 0.001). Faces that other faces cover wholly have no
               light and are left out
    balance    share of the emitted energy that is neither absorbed nor escapes

In every case the colours are finite and not negative, another attribute of the mesh does not
change, and a message names what is left out, clamped or refused.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent / "addon"), str(HERE)]
sys.dont_write_bytecode = True

import command_line  # noqa: E402
import raybundle  # noqa: E402
from conftest import (  # noqa: E402
    CUBE_FACES, CUBE_VERTICES, create_material, create_object, create_world)
from surface_error import (  # noqa: E402
    corner_areas, face_means, face_sizes, read_colors)

# As in native/stress/stability.cpp.
EXACT, STATED_SHARE, MOST_IMBALANCE = 1e-3, 1.25, 1e-3
MINE = (0.25, 0.5, 0.75, 1.0)  # value of a colour attribute of the user


@dataclass
class Case:
    """A scene, and what its bake must give."""

    name: str
    build: Callable[[], None]
    # Irradiance at every baked corner, W/m^2. None: any light with a balanced energy.
    light: float | None = 1.0
    # Text in a warning, or in the message with which the bake is refused.
    says: str = ""
    is_refused: bool = False
    is_dark: bool = False  # nothing gets light, which is checked
    hides_faces: bool = False  # some faces are wholly covered by others, or have no area
    settings: dict[str, object] = field(default_factory=dict)
    is_quick: bool = True


@dataclass
class Result:
    """The deviations of one case, relative, and what failed."""

    largest: float = np.nan
    rms: float = np.nan
    stated: float = np.nan
    balance: float = np.nan
    failures: list[str] = field(default_factory=list)

    def check(self, holds: bool, what: str) -> None:
        if not holds:
            self.failures.append(what)


# --------------------------------------------------------------------------------------------------
# Scenes
# --------------------------------------------------------------------------------------------------


def grey(reflectance: float, exitance: float) -> bpy.types.Material:
    return create_material("Grey", (reflectance,) * 3, (exitance / np.pi,) * 3)


def white() -> bpy.types.Material:
    if bpy.context.scene.world is None:
        create_world((1.0 / np.pi,) * 3)
    return bpy.data.materials.get("Grey") or grey(0.5, 0.5)


def cube(name: str = "Cube", low=(0.0, 0.0, 0.0), size: float = 1.0) -> bpy.types.Object:
    vertices = np.array(low) + size * (np.array(CUBE_VERTICES) + 1.0) / 2.0
    return create_object(name, vertices.tolist(), CUBE_FACES, white())


def ground() -> bpy.types.Object:
    return create_object("Ground", [(-2, -2, -0.3), (2, -2, -0.3), (2, 2, -0.3), (-2, 2, -0.3)],
                         [(0, 1, 2, 3)], white())


def polygons(vertices, *faces) -> bpy.types.Object:
    return create_object("Polygons", vertices, list(faces), white())


def room(reflectance: float = 0.5, exitance: float = 1.0, scale: float = 1.0,
         location: float = 0.0) -> None:
    item = create_object("Room", CUBE_VERTICES, [face[::-1] for face in CUBE_FACES],
                         grey(reflectance, exitance), (location,) * 3)
    item.scale = (scale,) * 3


def room_of_negative_emission() -> None:
    room()
    # A colour cannot be negative.
    nodes = bpy.data.materials["Grey"].node_tree.nodes
    next(node for node in nodes if node.type == 'EMISSION').inputs['Strength'].default_value = -1.0


def negative_world() -> None:
    create_world((1.0, 1.0, 1.0)).inputs['Strength'].default_value = -1.0
    create_object("Cube", CUBE_VERTICES, CUBE_FACES, create_material("Grey"))


def modified(kind: str, **values) -> bpy.types.Object:
    item = cube()
    modifier = item.modifiers.new("Modifier", kind)
    for name, value in values.items():
        setattr(modifier, name, value)
    return item


def masked_to_nothing() -> None:
    item = modified('MASK')
    item.vertex_groups.new(name="None")
    item.modifiers[0].vertex_group = "None"
    ground()


def sheared(factor: float) -> None:
    """Adds a cube, rotated by 45 degrees, whose parent is scaled along one axis."""
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale = (factor, 1.0, 1.0)
    child = cube()
    child.parent = parent
    child.rotation_euler = (0.0, 0.0, np.pi / 4)
    ground()


def scaled(*scale: float) -> None:
    cube().scale = scale
    ground()


def slivers(count: int) -> None:
    """Adds faces of 1 m by 1 micrometre, side by side."""
    rows = np.arange(count + 1) * 1e-6
    vertices = [(x, y, 0.0) for y in rows for x in (0.0, 1.0)]
    polygons(vertices, *[(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(count)])
    cube("Cube", (0.0, 0.0, 0.2))


def dust(count: int) -> None:
    random = np.random.default_rng(5)
    vertices = np.repeat(random.uniform(-1, 1, (count, 3)), 3, axis=0)
    vertices += random.uniform(-1e-3, 1e-3, vertices.shape)
    polygons(vertices.tolist(), *np.arange(3 * count).reshape(-1, 3).tolist())
    ground()


def cubes(*lows) -> None:
    for k, low in enumerate(lows):
        cube(f"Cube {k}", low)


def box_that_fills_a_room() -> None:
    cube()
    cube("Turned").data.flip_normals()


def interlocked_bars() -> None:
    """Adds three bars, each of which lies on the next."""
    corners = (np.array(CUBE_VERTICES) * (1.0, 0.1, 0.1)).tolist()
    for k in range(3):
        bar = create_object(f"Bar {k}", corners, CUBE_FACES, white())
        angle = 2.0 * np.pi * k / 3
        bar.rotation_euler = (0.0, 0.25, angle)
        bar.location = (-0.35 * np.sin(angle), 0.35 * np.cos(angle), 0.0)


def fan() -> None:
    points = [(0, 0), (1, 0), (-1, 1), (-1, -1)]
    polygons([(x, y, z) for x, y in points for z in (0, 1)],
             (0, 2, 3, 1), (0, 4, 5, 1), (0, 6, 7, 1))


def on_circle(count: int, radii=(1.0,)):
    return [(radii[k % len(radii)] * np.cos(2 * np.pi * k / count),
             radii[k % len(radii)] * np.sin(2 * np.pi * k / count), 0.0) for k in range(count)]


def with_vertex(*place: float) -> None:
    """Adds a mesh with one misplaced vertex, and another mesh."""
    item = cube("Broken")
    item.data.vertices[0].co = place
    cube("Whole", (2.0, 0.0, 0.0))


def without_faces() -> None:
    create_object("Points", CUBE_VERTICES, [], white())
    cube()


def wrong_material_index() -> None:
    item = cube()
    item.data.polygons.foreach_set('material_index', np.full(len(CUBE_FACES), 7, np.int32))
    ground()


def many_objects(count: int) -> None:
    first = cube("Cube", size=0.05)
    edge = int(np.ceil(count ** (1.0 / 3.0)))
    for k in range(1, count):
        item = bpy.data.objects.new(f"Cube {k}", first.data)
        item.location = (0.1 * (k % edge), 0.1 * (k // edge % edge), 0.1 * (k // edge // edge))
        bpy.context.scene.collection.objects.link(item)


def nested_instances(levels: int) -> None:
    """Adds a cube, three times in a collection, which is three times in another one, and so on."""
    ground()
    inner = bpy.data.collections.new("Level")
    item = cube(size=0.02)
    bpy.context.scene.collection.objects.unlink(item)
    inner.objects.link(item)
    for level in range(levels):
        outer = bpy.data.collections.new("Level")
        for k in range(3):
            empty = bpy.data.objects.new("Empty", None)
            empty.instance_type, empty.instance_collection = 'COLLECTION', inner
            empty.location[level % 3] = 0.1 * 3.0 ** (level // 3) * (k - 1)
            outer.objects.link(empty)
        inner = outer
    root = bpy.data.objects.new("Root", None)
    root.instance_type, root.instance_collection = 'COLLECTION', inner
    bpy.context.scene.collection.objects.link(root)


def lamp(kind: str, energy: float = 100.0, **values) -> None:
    """Adds a lamp in a room that is open at the top."""
    create_object("Room", CUBE_VERTICES, [face[::-1] for face in CUBE_FACES[:5]], grey(0.5, 0.0))
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = energy
    for name, value in values.items():
        setattr(data, name, value)
    item = bpy.data.objects.new("Lamp", data)
    item.location = (0.3, 0.2, 0.6)
    bpy.context.scene.collection.objects.link(item)


def cases() -> Iterator[Case]:
    yield from room_cases()
    yield from placement_cases()
    yield from mesh_cases()
    yield from value_cases()


def room_cases() -> Iterator[Case]:
    for reflectance in (0.0, 0.5, 0.9, 0.99, 0.999):
        yield Case(f"a room of reflectance {reflectance:g}", lambda r=reflectance: room(r),
                   1.0 / (1.0 - reflectance))
    for reflectance in (1.0, 10.0):
        yield Case(f"a room of reflectance {reflectance:g}", lambda r=reflectance: room(r),
                   1000.0, "clamped to 0.999")
    for exitance in (1e-12, 1e12):
        yield Case(f"a room that emits {exitance:g} W/m^2", lambda e=exitance: room(0.5, e),
                   2.0 * exitance)
    for scale in (1e-4, 1e4, 1e6):
        yield Case(f"a room {scale:g} times as large", lambda s=scale: room(scale=s), 2.0)
    for place in (1e4, 1e6):
        yield Case(f"a room {place:g} m from the origin", lambda p=place: room(location=p), 2.0)


def placement_cases() -> Iterator[Case]:
    yield Case("mirrored", lambda: scaled(-1, 1, 1))
    yield Case("mirrored three times", lambda: scaled(-1, -1, -1))
    yield Case("flattened to a plane", lambda: scaled(1, 1, 0), hides_faces=True)
    yield Case("flattened to a line", lambda: scaled(1, 0, 0), says="area", hides_faces=True)
    yield Case("shrunk to a point", lambda: scaled(0, 0, 0), says="area", hides_faces=True)
    yield Case("sheared by a parent, tenfold", lambda: sheared(10))
    yield Case("sheared by a parent, a thousandfold", lambda: sheared(1000))


def mesh_cases() -> Iterator[Case]:
    yield Case("slivers of 1 m by 1e-6 m", lambda: slivers(1000), is_quick=False)
    yield Case("50 slivers of 1 m by 1e-6 m", lambda: slivers(50))
    yield Case("ten thousand triangles of a millimetre", lambda: dust(10000))
    yield Case("a cube twice", lambda: cubes((0, 0, 0), (0, 0, 0)), hides_faces=True)
    yield Case("a cube twice, 1e-7 m apart", lambda: cubes((0, 0, 0), (1e-7, 1e-7, 1e-7)),
               hides_faces=True)
    # By their depths, these cubes are a box that fills a room: no light gets between them.
    yield Case("a box that fills a room", box_that_fills_a_room, None, is_dark=True)
    yield Case("a cube with a shell of no thickness", lambda: modified('SOLIDIFY', thickness=0.0))
    yield Case("cubes that intersect",
               lambda: cubes((0, 0, 0), (0.5, 0.5, 0.5), (0.3, -0.4, 0.2)))
    yield Case("cubes with touching faces", lambda: cubes((0, 0, 0), (1, 0, 0), (0.5, 1, 0)),
               hides_faces=True)
    yield Case("three interlocked bars", interlocked_bars)
    yield Case("three faces at an edge", fan)
    yield Case("a cube without a lid",
               lambda: polygons(CUBE_VERTICES, *CUBE_FACES[:5]))
    yield Case("faces without area, and corners on a line",
               lambda: polygons([(0, 0, 0), (1, 0, 0), (2, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0)],
                                (0, 1, 2), (0, 1, 5), (0, 1, 2, 3, 4)),
               says="area", hides_faces=True)
    yield Case("a concave face", lambda: polygons(on_circle(10, (1.0, 0.3)), range(10)))
    # Its slivers meet few lines: bundles take 4 s, and 20 at the default target.
    yield Case("a face of a thousand corners", lambda: polygons(on_circle(1000), range(1000)),
               settings={"target_error": 0.1})
    yield Case("a face that crosses itself",
               lambda: polygons([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], (0, 1, 2, 3)))
    yield Case("a face that is not planar",
               lambda: polygons([(0, 0, 0), (1, 0, 0.5), (1, 1, 0), (0, 1, 0.5)], (0, 1, 2, 3)))
    yield Case("one triangle", lambda: polygons([(0, 0, 0), (1, 0, 0), (0, 1, 0)], (0, 1, 2)))
    yield Case("one patch", lambda: polygons([(0, 0, 0), (1, 0, 0), (0, 1, 0)], (0, 1, 2)),
               settings={"patch_size": 100.0})
    yield Case("a vertex that is not a number", lambda: with_vertex(np.nan, 0.0, 0.0),
               says="Broken")
    yield Case("a vertex at infinity", lambda: with_vertex(np.inf, 0.0, 0.0), says="Broken")
    yield Case("a vertex 1e30 m away", lambda: with_vertex(1e30, 0.0, 0.0), says="Broken")
    yield Case("an object without faces", without_faces)
    yield Case("faces of a missing material", wrong_material_index, None)
    yield Case("a modifier that removes all faces", masked_to_nothing)
    yield Case("a cube in a row of 200",
               lambda: modified('ARRAY', count=200, relative_offset_displace=(1.5, 0.0, 0.0)))
    yield Case("1000 objects", lambda: many_objects(1000))
    yield Case("10 000 objects", lambda: many_objects(10000), is_quick=False)
    yield Case("instances five levels deep", lambda: nested_instances(5))
    yield Case("an empty scene", lambda: None, None, "Nothing to bake", True)


def value_cases() -> Iterator[Case]:
    """Returns cases of values of materials, the world and lamps."""
    yield Case("an emission of -1 W/m^2", room_of_negative_emission, None, "Grey",
               is_dark=True)
    yield Case("an emission that is not a number", lambda: room(0.5, np.nan), None, "Grey", True)
    yield Case("a reflectance that is not a number", lambda: room(np.nan), None, "Grey", True)
    yield Case("a world that is not a number", lambda: (cube(), create_world((np.nan,) * 3)), None,
               "world", True)
    yield Case("a negative world", negative_world, None, "World", is_dark=True)

    yield Case("a lamp of 0 W", lambda: lamp('POINT', 0.0), None, is_dark=True)
    yield Case("a lamp of 1e12 W", lambda: lamp('POINT', 1e12), None)
    yield Case("a lamp of -100 W", lambda: lamp('POINT', -100.0), None, "Lamp",
               is_dark=True)
    yield Case("a lamp whose power is not a number", lambda: lamp('POINT', np.nan), None, "Lamp",
               is_dark=True)
    yield Case("a point without radius", lambda: lamp('POINT', shadow_soft_size=0.0), None)
    yield Case("an area lamp without area", lambda: lamp('AREA', size=0.0), None,
               is_dark=True)
    # Blender allows no less than 1 degree. All reflected light comes from a place of 3 cm, whose
    # bundles are noisy at the default target.
    yield Case("a spot of 0 degrees", lambda: lamp('SPOT', spot_size=0.0), None,
               settings={"target_error": 0.0005, "max_bundles": 65536})
    yield Case("a spot of 180 degrees", lambda: lamp('SPOT', spot_size=np.pi, spot_blend=0.0), None)
    yield Case("a sun of 180 degrees", lambda: lamp('SUN', 1.0, angle=np.pi), None)


# --------------------------------------------------------------------------------------------------
# Measure
# --------------------------------------------------------------------------------------------------


def user_colors(mesh: bpy.types.Mesh) -> None:
    """Adds a colour attribute that no bake may change."""
    values = mesh.color_attributes.new("Mine", 'FLOAT_COLOR', 'CORNER').data
    values.foreach_set('color', np.tile(np.array(MINE, np.float32), len(values)))


def measure(case: Case) -> Result:
    bpy.ops.wm.read_homefile(use_empty=True)
    case.build()
    bpy.context.view_layer.update()
    meshes = [item for item in bpy.context.scene.objects if item.type == 'MESH']
    if meshes and len(meshes[0].data.polygons):
        user_colors(meshes[0].data)
    result = Result()
    said = []
    try:
        report = raybundle.bake(bpy.context, **{"output": 'LIGHTING', **case.settings})
        said = report.warnings
        result.check(not case.is_refused, "it was not refused")
    except (raybundle.BakeError, raybundle.RaybundleError) as error:
        said = [str(error)]
        result.check(case.is_refused, f"refused: {error}")
        report = None
    result.check(any(case.says in text for text in said) or not case.says,
                 f'nothing says "{case.says}": {said}')
    for item in meshes:
        if "Mine" in item.data.color_attributes:
            result.check(bool((read_colors(item, "Mine") == MINE[:3]).all()), "Mine has changed")
    if report is None:
        return result
    baked = [item for item in meshes if "Radiosity" in item.data.color_attributes]
    result.check(len(baked) > 0, "nothing is baked")
    light = [np.pi * read_colors(item).astype(np.float64) for item in baked]
    result.check(all(np.isfinite(values).all() and (values >= 0.0).all() for values in light),
                 "not finite")
    result.stated = report.error['total']
    result.balance = report.energy['balance_error']
    result.check(result.balance <= MOST_IMBALANCE, "balance")
    if baked:
        result.check(any(values.any() for values in light) != case.is_dark,
                     "light" if case.is_dark else "no light")
    if case.light is not None and baked:
        compare(case, baked, light, result)
    return result


def compare(case: Case, items: list[bpy.types.Object], light: list[np.ndarray], result: Result
            ) -> None:
    """Compares the light of a bake with the exact one.

    light: irradiance of each object, (corners, 3), W/m^2.
    """
    corners, faces, areas = [], [], []
    for item, values in zip(items, light):
        means = face_means(item, values)
        is_compared = means.any(axis=1) if case.hides_faces else np.ones(len(means), bool)
        sizes = face_sizes(item.data)
        corners.append(values[np.repeat(is_compared, sizes)])
        faces.append(means[is_compared])
        areas.append(np.add.reduceat(corner_areas(item), np.cumsum(sizes) - sizes)[is_compared])
    result.check(sum(map(len, faces)) > 0, "no face is lit")
    result.largest = np.abs(np.concatenate(corners) / case.light - 1.0).max(initial=0.0)
    squares = ((np.concatenate(faces) / case.light - 1.0) ** 2).mean(axis=1)
    weights = np.concatenate(areas)
    result.rms = np.sqrt(weights @ squares / max(weights.sum(), 1e-30))
    result.check(result.rms <= max(EXACT, STATED_SHARE * result.stated), "RMS")


def row(case: Case, result: Result) -> str:
    def number(value: float) -> str:
        return "-" if np.isnan(value) else f"{value:.2g}"

    expected = "balance" if case.light is None else f"irradiance {case.light:g}"
    if case.is_dark:
        expected = "no light"
    if case.is_refused:
        expected = "refused"
    if case.says:
        expected += f', "{case.says}"'
    outcome = "; ".join(["FAIL", *result.failures]) if result.failures else "pass"
    return (f"| Blender | {case.name} | {expected} | {number(result.largest)} | "
            f"{number(result.rms)} | {number(result.stated)} | {number(result.balance)} | "
            f"{outcome} |")


def main(arguments: list[str]) -> None:
    parser = command_line.parser(__file__, __doc__)
    parser.add_argument("--quick", action="store_true", help="without the long ones")
    parser.add_argument("--only", default="", help="cases with this in their name")
    options = parser.parse_args(arguments)
    raybundle.register()
    print("| group | case | expected | largest | RMS | stated | balance | |\n"
          "|---|---|---|---|---|---|---|---|")
    failed = 0
    for case in cases():
        if options.only not in case.name or (options.quick and not case.is_quick):
            continue
        result = measure(case)
        failed += bool(result.failures)
        print(row(case, result), flush=True)
    if failed:
        sys.exit(f"{failed} cases failed")


if __name__ == "__main__":
    main(command_line.arguments())
