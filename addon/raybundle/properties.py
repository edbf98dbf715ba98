# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a scene (scene.raybundle) and of an object (object.raybundle).

Settings of the native library are defined here a second time, because properties must be registered
even if the library is missing. A test compares names, types, defaults, ranges, choices and
descriptions with those of the library (native.settings()), so that both agree. Files store the
position of a choice in its list, so new choices must be added at the end.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import bpy
from bpy.props import (BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty,
                       PointerProperty, StringProperty)

from . import preferences, quality, viewport_preview
from .engine_presets import ENUM_ENGINE, apply_preset

enum_scope = (
    ('VISIBLE', "Visible", "Bake all objects that are visible in the viewport and in renders"),
    ('SELECTED', "Selected",
     "Bake the selected objects; other visible objects still reflect and block light"),
)

enum_output = (
    ('LIGHTING', "Lighting",
     "Light on a white surface: irradiance / pi, as in Cycles' Diffuse bake without Color. To show "
     "it, multiply it by the material's colour"),
    ('COMBINED', "Combined",
     "Radiance that leaves the surface: emission and reflected light with the material's colour"),
    ('DIRECT', "Direct",
     "The part of Lighting that comes straight from lights, emission and world"),
    ('INDIRECT', "Indirect", "The part of Lighting that other surfaces have reflected"),
)

enum_domain = (
    ('CORNER', "Face Corner", "One value per corner of each face: light may differ on the two "
     "sides of a sharp edge"),
    ('POINT', "Vertex", "One value per vertex: the mean of its corners"),
)

enum_data_type = (
    ('FLOAT_COLOR', "Color", "Scene-linear floats without an upper limit"),
    ('BYTE_COLOR', "Byte Color", "8 bits per channel, sRGB; light above 1 is cut off"),
)

enum_topology = (
    ('KEEP', "Keep", "Write to the existing vertices of the meshes"),
    ('SUBDIVIDE', "Subdivide",
     "Write to a finer copy of each object, and hide the original until you press Clear"),
    ('ADAPTIVE', "Adaptive",
     "Write to a copy of each object that has more vertices where the light needs them, at the "
     "edges of shadows, at contacts and near lamps, and hide the original until you press Clear. "
     "The light is computed twice"),
)

enum_shared_meshes = (
    ('SINGLE_USER', "Copies",
     "Objects that share a mesh each get a copy of it, with their own light"),
    ('AVERAGE', "Average", "Objects that share a mesh keep sharing it and show their mean light"),
)

# The native library's settings "skip.NAME".
enum_skip = (
    ('darkness', "Darkness", "Leave out the bundles and the solve if no light reaches any surface"),
    ('reflection', "Reflection",
     "Leave out the bundles and the solve if no surface reflects light and lines carry no other "
     "light"),
    ('geometry', "Geometry",
     "Keep patches and lines if the geometry is unchanged since the last bake"),
    ('lights', "Lights",
     "Keep the first shot if geometry and lights are unchanged since the last bake"),
    ('facing', "Facing", "Leave out shadow rays to a light that the surface cannot face"),
    ('occluders', "Occluders", "Leave out the reconstruction of objects that are not baked"),
    ('lit', "Lit",
     "Leave out the noise of a light that is fully visible, because its light is known exactly"),
    ('weak', "Weak", "Leave out most shadow rays to a light that contributes little"),
    ('inside', "Inside", "Leave out most shadow rays from the inside of solids"),
    ('gather', "Gather", "Leave out the final gather where interpolation is accurate enough"),
    ('bundles', "Bundles", "Leave out further bundles when the noise has reached its target"),
    ('warm_start', "Warm Start",
     "Start the solve from the solution of the last bake, which takes fewer iterations"),
    ('sheets', "Sheets", "Project neighbouring faces of equal shape in one plane together"),
    ('lamp_insides', "Lamp Insides",
     "Leave out the emission inside closed surfaces that contain nothing else"),
    ('clusters', "Clusters",
     "Exchange light between clusters of patches where patches are not shown and finer than "
     "needed"),
)

enum_solver = (
    ('LINE_REUSE', "Line Reuse",
     "Store all lines in a sparse matrix and solve the system of this matrix to convergence"),
    ('MULTIPATH', "Multipath",
     "Each bundle passes on a part of the light that is not distributed yet. Two chains, each of "
     "half of the bundles, measure the noise"),
    ('STOCHASTIC_ITERATION', "Stochastic Iteration",
     "Each bundle passes on all the light that the previous bundle brought; the result is the "
     "mean. Two chains, each of half of the bundles, measure the noise"),
    ('RANDOM_WALK', "Random Walk",
     "Light follows random local rays from surface to surface; there are no bundles"),
)

enum_first_shot = (
    ('GATHER', "Gather", "Trace shadow rays from the receivers to the lights"),
    ('SHOOT', "Shoot", "Trace rays from the lights to the first surfaces that they meet"),
    ('EXTENDED', "Extended",
     "Shoot, then continue from surfaces brighter than the mean until light is everywhere"),
)

enum_directions = (
    ('LOW_DISCREPANCY', "Low Discrepancy", "Evenly spread directions, which give the least noise"),
    ('RANDOM', "Random", "Independent uniform directions"),
    ('ADAPTIVE', "Adaptive", "Independent directions, denser where more light passes"),
)

enum_projector = (
    ('AUTO', "Automatic", "The fastest exact projector"),
    ('FRAGMENT_LISTS', "Fragment Lists", "Exact lists of fragments per pixel, sorted by depth"),
    ('PAINTER', "Painter",
     "Patches are drawn in the order of their centres, which is wrong where they overlap in depth"),
    ('PAINTER_NEWELL', "Painter, Newell",
     "Patches are drawn in an order that Newell's tests have verified; cycles are broken and "
     "counted"),
    ('PLANE', "Plane", "Two depth buffers per direction, one on each side of a random plane"),
    ('PLANES', "Planes", "Two depth buffers for each of several planes per direction"),
)

enum_plane_placement = (
    ('SYSTEMATIC', "Systematic", "At equal distances, with one common random shift"),
    ('STRATIFIED', "Stratified", "At a random position in each of several equal intervals"),
    ('CLOSE_DISTANCE', "Close Distance",
     "Some planes near surfaces, to separate surfaces that lie close together"),
)

enum_estimator = (
    ('COLLISION', "Collision",
     "A walk contributes light at every surface that it meets, which gives the least noise"),
    ('SURVIVAL', "Survival", "A walk contributes light where it continues"),
    ('ABSORPTION', "Absorption", "A walk contributes light where it ends"),
)

enum_small_patches = (
    ('CENTRE_SAMPLING', "Centre Sampling",
     "A line meets the patches that cover the centre of its pixel: unbiased for patches of any "
     "size"),
    ('ROULETTE', "Roulette",
     "A patch fills whole pixels; a patch smaller than a pixel is drawn with a probability "
     "proportional to its area"),
)

enum_reconstruction = (
    ('LEAST_SQUARES', "Least Squares",
     "Vertex values whose interpolation over the faces is closest to the light on the surface"),
    ('AREA_AVERAGE', "Area Average",
     "The mean of the light on the faces around each vertex: never too bright or too dark, but "
     "blurred"),
    ('POINT', "Point", "The light at the vertices themselves, as Cycles bakes it"),
)

enum_role = (
    ('BAKE', "Bake", "Takes part in the light and gets colours"),
    ('OCCLUDE', "Occlude", "Reflects and blocks light, but gets no colours"),
    ('IGNORE', "Ignore", "Takes no part in the bake"),
)

enum_side = (
    ('FRONT', "Front", "Bake the light on the side that the normals point to"),
    ('BACK', "Back", "Bake the light on the other side, for example inside a room whose normals "
     "point outward"),
)

enum_show_in = (
    ('SOLID', "Solid",
     "At once: the values themselves, without surface colours and the scene's view transform"),
    ('MATERIALS', "Materials",
     "Light times surface colour, through the scene's view transform: a bake and Preview add the "
     "light to the materials, as Use in Material does, and switch to Material Preview"),
)

enum_shown_as = (
    ('AUTO', "Automatic",
     "The output Combined as Light Alone, and other outputs as Light Times Colour"),
    ('EMISSION', "Light Alone",
     "Unlit: the camera sees the attribute itself. For the output Combined"),
    ('COLORED', "Light Times Colour",
     "Unlit: the camera sees the attribute times the colour of the surface. For Lighting, Direct "
     "and Indirect"),
    ('FACTOR', "Factor on Colour",
     "The attribute multiplies the colour of the surface, which lamps go on to light. Hide the "
     "lamps that were baked, or their light counts twice"),
)

enum_export_format = (
    ('SHORT', "16 Bits", "65,536 levels from 0 to 1: no visible steps"),
    ('BYTE', "8 Bits", "256 linear levels from 0 to 1: the smallest file, with steps in the dark"),
    ('FLOAT', "Floats", "The values themselves, in the largest file; not all engines read them"),
)

enum_channel = (
    ('NONE', "Empty", "Nothing: the channel is 0, or 1 if it is alpha"),
    ('LIGHTING', "Lighting", "Light on a white surface"),
    ('DIRECT', "Direct",
     "The part of Lighting that comes straight from lights, emission and world"),
    ('INDIRECT', "Indirect", "The part of Lighting that other surfaces have reflected"),
    ('COMBINED', "Combined", "Emission and reflected light with the material's colour"),
    ('AO', "Ambient Occlusion",
     "The share of a white sky that a surface sees: 1 in the open, 0 in closed rooms"),
    ('SET_1', "Light Set 1", "Lighting of the first light set"),
    ('SET_2', "Light Set 2", "Lighting of the second light set"),
    ('SET_3', "Light Set 3", "Lighting of the third light set"),
    ('SET_4', "Light Set 4", "Lighting of the fourth light set"),
)

enum_export_range = (
    ('AUTO', "Automatic",
     "If light is brighter than 1, all light is divided by the largest value. The engine can "
     "multiply it by this scale again, which is in the file's extras"),
    ('FULL', "Full",
     "All light is divided by the largest value, which becomes 1: the finest steps. The engine can "
     "multiply it by this scale again, which is in the file's extras"),
    ('KEEP', "Unchanged", "Light is written as it is; 8 and 16 bits cut it off at 1"),
)


def _is_mesh_object(_self: bpy.types.PropertyGroup, item: bpy.types.Object) -> bool:
    return item.type == 'MESH'


def _apply_engine(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    apply_preset(settings, settings.engine)


class RaybundleLightSet(bpy.types.PropertyGroup):
    name: StringProperty(name="Name", description="Name of the light set")
    enabled: BoolProperty(
        name="Enabled", description="Bake the set into an attribute of its own", default=True)
    collection: PointerProperty(
        name="Collection",
        description="The lights and emissive objects of this collection and its children form "
                    "the set",
        type=bpy.types.Collection)
    world: BoolProperty(
        name="World", description="The light of the world belongs to the set", default=False)
    attribute: StringProperty(
        name="Attribute",
        description="Name of the colour attribute for the light of the set. If empty, the name is "
                    "the scene's attribute followed by the name of the set")


class RaybundleSceneSettings(bpy.types.PropertyGroup):
    scope: EnumProperty(
        name="Scope", description="Which objects get colours", items=enum_scope,
        default='VISIBLE')
    target_error: FloatProperty(
        name="Noise", description="Relative noise of the light at which the bake stops",
        default=0.02, min=0.0005, max=1.0, soft_max=0.2, precision=4, step=0.1)
    # These two show target_error and set it; they store nothing.
    quality: EnumProperty(
        name="Quality", description="The noise at which the bake stops, in three steps",
        items=quality.enum_quality, get=quality.get_quality, set=quality.set_quality)
    target_percent: FloatProperty(
        name="Noise",
        description="Noise of the light at which the bake stops, in % of the light there. 95 of "
                    "100 vertices are then within about twice this value of a converged bake",
        min=0.05, max=100.0, soft_max=20.0, precision=2, step=10, subtype='PERCENTAGE',
        get=quality.get_percent, set=quality.set_percent)
    output: EnumProperty(
        name="Output", description="Which quantity is written", items=enum_output,
        default='LIGHTING')
    attribute: StringProperty(
        name="Attribute", description="Name of the colour attribute that is written",
        default="Radiosity")
    domain: EnumProperty(
        name="Domain", description="Which elements have a value", items=enum_domain,
        default='CORNER')
    data_type: EnumProperty(
        name="Data Type", description="How values are stored", items=enum_data_type,
        default='FLOAT_COLOR')
    exposure: FloatProperty(
        name="Exposure", description="Change of the brightness of the written values, in stops; 0 "
                                     "writes the light unchanged",
        default=0.0, min=-32.0, max=32.0, soft_min=-10.0, soft_max=10.0, precision=2, step=10)
    clamp: BoolProperty(
        name="Clamp", description="Cut written values off at 1, after the exposure is applied",
        default=False)
    live: BoolProperty(
        name="Live", default=False,
        description="The light follows changes of lamps, materials, the world and the places of "
                    "objects: as a draft at first, and as a bake when the changes stop. Changes of "
                    "the shape of meshes are not followed")
    show_result: BoolProperty(
        name="Show Result", default=True,
        description="While a bake runs and after it, show the baked colours in all 3D views. "
                    "Preview switches back to the earlier shading")
    show_in: EnumProperty(
        name="Show In", description="How the 3D views show baked light", items=enum_show_in,
        default='SOLID', update=viewport_preview.follow_choice)
    is_light_lent: BoolProperty(
        name="Lent to Materials", options={'HIDDEN'},
        description="Whether the light is in the materials only as long as the preview shows it")
    write_error: BoolProperty(
        name="Write Error",
        description="Also write the stated error of the light, one number per corner or vertex, "
                    "to a second attribute whose name ends with \"Error\"",
        default=False)
    topology: EnumProperty(
        name="Topology", description="Whether the bake writes to the meshes or to finer copies",
        items=enum_topology, default='KEEP')
    max_vertices: IntProperty(
        name="Maximum Vertices",
        description="Maximum number of vertices of all adapted meshes together; meshes that have "
                    "more keep theirs",
        default=100_000, min=1, max=2 ** 26, soft_max=10_000_000)
    discontinuity_lines: BoolProperty(
        name="Discontinuity Lines",
        description="Let edges of adapted meshes follow the edges of hard shadows, where this "
                    "takes few vertices; the light then differs between the corners of a vertex, "
                    "which one value per vertex cannot show",
        default=True)
    simplify: BoolProperty(
        name="Simplify",
        description="Write the light to copies without the vertices that neither it nor the shape "
                    "needs at the target noise, for export to small devices. Bake Channels does not "
                    "simplify")
    count_adaptive: BoolProperty(
        name="Count Adaptive",
        description="Count the vertices that the topology Adaptive would need, without changing "
                    "any mesh; takes some time more")
    shared_meshes: EnumProperty(
        name="Shared", description="How the light of baked objects with the same mesh is written",
        items=enum_shared_meshes, default='SINGLE_USER')
    patch_size: FloatProperty(
        name="Patch Size",
        description="Edge length of the patches on which the light is computed; 0 chooses it "
                    "automatically",
        default=0.0, min=0.0, max=1e9, soft_max=10.0, precision=3, step=1, subtype='DISTANCE',
        unit='LENGTH')
    max_patches: IntProperty(
        name="Maximum Patches",
        description="Maximum number of patches; patches become larger to stay below it, and small "
                    "faces share patches",
        default=100_000, min=1, max=2 ** 23, soft_min=1_000, soft_max=1_000_000)
    refine: BoolProperty(
        name="Refine",
        description="Use smaller patches at the edges of shadows and close to lamps, if the gain "
                    "is worth the time",
        default=False)
    contacts: BoolProperty(
        name="Contacts",
        description="Use smaller patches beside gaps much narrower than a patch, such as on a "
                    "table below the rim of a plate",
        default=True)
    solver: EnumProperty(
        name="Solver", description="How surfaces exchange light", items=enum_solver,
        default='LINE_REUSE')
    estimator: EnumProperty(
        name="Estimator",
        description="Which events of a walk contribute light, for the solver Random Walk",
        items=enum_estimator, default='COLLISION')
    first_shot: EnumProperty(
        name="First Shot",
        description="How the light of lamps and the world is distributed before any bundle",
        items=enum_first_shot, default='GATHER')
    local_rays: IntProperty(
        name="Local Rays",
        description="Number of rays from the lights, for the first shots Shoot and Extended; 0 "
                    "chooses it automatically",
        default=0, min=0, max=2 ** 31 - 1, soft_max=100_000_000)
    directions: EnumProperty(
        name="Directions", description="How the directions of the bundles are chosen",
        items=enum_directions, default='LOW_DISCREPANCY')
    projector: EnumProperty(
        name="Projector", description="How the lines of a bundle find the surfaces that they meet",
        items=enum_projector, default='AUTO')
    plane_count: IntProperty(
        name="Planes", description="Number of planes per direction, for the projector Planes",
        default=4, min=1, max=64)
    plane_placement: EnumProperty(
        name="Plane Placement", description="Where the projector Planes places its planes",
        items=enum_plane_placement, default='SYSTEMATIC')
    small_patches: EnumProperty(
        name="Small Patches", description="How lines meet patches that are smaller than a pixel",
        items=enum_small_patches, default='CENTRE_SAMPLING')
    reconstruction: EnumProperty(
        name="Reconstruction", description="How the light on patches becomes values at vertices",
        items=enum_reconstruction, default='LEAST_SQUARES')
    final_gather: BoolProperty(
        name="Final Gather",
        description="Gather the light of other surfaces at the vertices too, where it varies "
                    "between them; for the reconstruction Point and for meshes that modifiers "
                    "subdivide",
        default=True)
    max_bundles: IntProperty(
        name="Maximum Bundles",
        description="Maximum number of bundles, even if the noise is still above the target",
        default=65_536, min=2, max=2 ** 24, soft_max=65_536)
    lines_per_bundle: IntProperty(
        name="Lines per Bundle",
        description="Number of lines in each bundle; 0 chooses it automatically, at two lines per "
                    "patch",
        default=0, min=0, max=2 ** 26, soft_max=10_000_000)
    memory_limit: FloatProperty(
        name="Memory Limit",
        description="Maximum memory of a bake, in MB, half of it for the exchanges between "
                    "patches; 0 allows three quarters of the computer's memory",
        default=0.0, min=0.0, max=1e9, soft_max=262_144.0, precision=0, step=6400)
    seed: IntProperty(
        name="Seed", description="Seed of the random numbers; the same seed gives the same noise",
        default=0, min=0)
    threads: IntProperty(
        name="Threads", description="Number of processor threads; 0 uses all", default=0, min=0,
        soft_max=64, max=1024)
    skips_off: EnumProperty(
        name="Skips Off",
        description="Skips that are switched off: their work is done although the scene does not "
                    "need it, to test that the result stays the same",
        items=enum_skip, options={'ENUM_FLAG'}, default=set())
    light_sets: CollectionProperty(
        name="Light Sets",
        description="Groups of lights. The light of each group is baked into its own attribute",
        type=RaybundleLightSet)
    light_set_index: IntProperty(name="Light Set", description="The selected light set")
    report: StringProperty(
        name="Report", description="The report of the last bake, as JSON")
    last_surfaces: StringProperty(
        name="Last Surfaces", description="The surfaces of the materials in the last bake, as JSON",
        options={'HIDDEN'})
    # How baked light is shown in materials and exported.
    engine: EnumProperty(
        name="For", description="The program that shows the light: sets what is baked and exported "
                                "so that it arrives there unchanged",
        items=ENUM_ENGINE, default='BLENDER',
        update=_apply_engine)
    shown_as: EnumProperty(
        name="Show As", description="How Use in Material shows the light", items=enum_shown_as,
        default='AUTO')
    export_format: EnumProperty(
        name="Format", description="How the export stores the light", items=enum_export_format,
        default='SHORT')
    export_range: EnumProperty(
        name="Range", description="How light is fitted into the range 0 to 1 of glTF",
        items=enum_export_range, default='AUTO')
    channel_r: EnumProperty(
        name="Red", description="Part of the light that Bake Channels writes to the red channel",
        items=enum_channel, default='DIRECT')
    channel_g: EnumProperty(
        name="Green",
        description="Part of the light that Bake Channels writes to the green channel",
        items=enum_channel, default='INDIRECT')
    channel_b: EnumProperty(
        name="Blue", description="Part of the light that Bake Channels writes to the blue channel",
        items=enum_channel, default='AO')
    channel_a: EnumProperty(
        name="Alpha",
        description="Part of the light that Bake Channels writes to the alpha channel",
        items=enum_channel, default='NONE')
    export_check: StringProperty(
        name="Export Check", description="What the last check of the export has found, as JSON",
        options={'HIDDEN'})


class RaybundleObjectSettings(bpy.types.PropertyGroup):
    role: EnumProperty(
        name="Role", description="How the object takes part in a bake", items=enum_role,
        default='BAKE')
    side: EnumProperty(
        name="Side", description="The side of the faces whose light is baked", items=enum_side,
        default='FRONT')
    quality: EnumProperty(
        name="Quality", description="How exactly the light of the object is computed, compared "
                                    "with the scene", items=quality.enum_object_quality,
        default='SCENE')
    source: PointerProperty(
        name="Source", description="The original of this finer copy",
        type=bpy.types.Object, poll=_is_mesh_object)
    last_surfaces: StringProperty(
        name="Last Surfaces",
        description="The surfaces of the material slots in the last bake, in the scene's table",
        options={'HIDDEN'})


@dataclass(frozen=True)
class BakeSettings:
    """The settings of one bake: those of the scene, some of which may be overridden."""

    scope: str
    target_error: float
    output: str
    attribute: str
    domain: str
    data_type: str
    exposure: float
    clamp: bool
    write_error: bool
    topology: str
    max_vertices: int
    discontinuity_lines: bool
    simplify: bool
    count_adaptive: bool
    shared_meshes: str
    patch_size: float
    max_patches: int
    refine: bool
    contacts: bool
    solver: str
    estimator: str
    first_shot: str
    local_rays: int
    directions: str
    projector: str
    plane_count: int
    plane_placement: str
    small_patches: str
    reconstruction: str
    final_gather: bool
    max_bundles: int
    lines_per_bundle: int
    memory_limit: float
    seed: int
    threads: int
    skips_off: set[str]

    @classmethod
    def names(cls) -> list[str]:
        """Returns the names of all settings."""
        return [item.name for item in fields(cls)]


def read_settings(scene: bpy.types.Scene, overrides: dict[str, object]) -> BakeSettings:
    """Returns the settings of a scene, with overrides by name. Raises ValueError for an override
    that is unknown, and for a value, overridden or stored, that the property does not allow. Stored
    values are checked because Blender stores NaN in spite of a property's limits. Threads and
    memory that the scene leaves at automatic are those of the add-on's preferences."""
    names = BakeSettings.names()
    for name in overrides:
        if name not in names:
            raise ValueError(f'unknown setting "{name}": choose one of {", ".join(names)}')
    stored = {name: getattr(scene.raybundle, name) for name in names}
    values = {name: checked_value(name, value) for name, value in
              {**stored, **automatic_values(scene.raybundle), **overrides}.items()}
    return BakeSettings(**values)


def automatic_values(settings: RaybundleSceneSettings) -> dict[str, object]:
    """Returns the add-on's preferences for the settings that a scene leaves at automatic, by name:
    threads if they are 0, memory_limit if it was never set. {}: the add-on has no preferences,
    because a script registered it."""
    user = preferences.get()
    values = {}
    if user is not None and settings.threads == 0:
        values['threads'] = user.threads
    if user is not None and not settings.is_property_set('memory_limit'):
        values['memory_limit'] = user.memory_limit
    return values


def assign(settings: RaybundleSceneSettings, name: str, value: object) -> None:
    """Sets a setting of scene.raybundle to a value, which may be text. The name "skip.NAME"
    switches a skip on or off.

    Raises KeyError for an unknown name, and ValueError for a value that the setting does not allow.
    """
    section, dot, skip = name.partition(".")
    if dot and section == "skip":
        if skip not in {item[0] for item in enum_skip}:
            raise KeyError(name)
        off = settings.skips_off
        settings.skips_off = off - {skip} if _checked_bool(name, value) else off | {skip}
        return
    setattr(settings, name, checked_value(name, value))


def checked_value(name: str, value: object) -> object:
    """Returns the value, which may be text, in the type of the scene setting of this name. Raises
    KeyError for an unknown name, and ValueError for a value that the setting does not allow."""
    definition = RaybundleSceneSettings.bl_rna.properties[name]
    if definition.type == 'ENUM' and definition.is_enum_flag:
        unknown = set(value) - set(definition.enum_items.keys())
        if unknown:
            raise ValueError(f'{name}: unknown {", ".join(sorted(unknown))}, choose from '
                             f'{", ".join(definition.enum_items.keys())}')
        return set(value)
    if definition.type == 'ENUM':
        choices = [item.identifier for item in definition.enum_items]
        if value not in choices:
            raise ValueError(f'{name}: unknown value "{value}", choose one of {", ".join(choices)}')
        return value
    if definition.type == 'BOOLEAN':
        return _checked_bool(name, value)
    if definition.type == 'STRING':
        return str(value)
    try:
        number = int(value) if definition.type == 'INT' else float(value)
    except (TypeError, ValueError) as error:
        raise ValueError(f'{name}: "{value}" is not a number') from error
    low, high = definition.hard_min, definition.hard_max
    if definition.type == 'FLOAT':  # stored in single precision, in which 0.0005 is slightly larger
        low, high = float(f"{low:g}"), float(f"{high:g}")
    if not low <= number <= high:
        raise ValueError(f"{name}: {number} is not between {low:g} and {high:g}")
    return number


def _checked_bool(name: str, value: object) -> bool:
    choices = {'0': False, 'false': False, '1': True, 'true': True}
    if str(value).lower() not in choices:
        raise ValueError(f'{name}: "{value}" is neither true nor false')
    return choices[str(value).lower()]


_register_classes, _unregister_classes = bpy.utils.register_classes_factory((
    RaybundleLightSet,
    RaybundleSceneSettings,
    RaybundleObjectSettings,
))


def register() -> None:
    _register_classes()
    bpy.types.Scene.raybundle = PointerProperty(
        name="Raybundle", description="Settings of Raybundle", type=RaybundleSceneSettings)
    bpy.types.Object.raybundle = PointerProperty(
        name="Raybundle", description="Settings of Raybundle", type=RaybundleObjectSettings)


def unregister() -> None:
    del bpy.types.Object.raybundle
    del bpy.types.Scene.raybundle
    _unregister_classes()
