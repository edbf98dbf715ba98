# SPDX-License-Identifier: GPL-3.0-or-later
"""Warns of features that change Cycles' diffuse light but not that of a bake, and names remedies.

Each function yields lines for the report. docs/limits.md lists all of these features, and those
that the bake supports.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import bpy

from .materials.node_links import output_node
from .warning_lines import listed

# Types of objects that a bake leaves out, and the warning for each.
UNREAD_TYPES = {
    'CURVES': "hair curves neither block nor reflect light here: convert them to a mesh with "
              "thickness",
    'POINTCLOUD': "points neither block nor reflect light here: have spheres instanced on them, or "
                  "convert them to a mesh",
    'VOLUME': "a volume neither dims nor scatters light here: convert it to a mesh, or hide it in "
              "renders to compare with Cycles",
}
# Blender's defaults. Lower values were chosen by the user.
_BOUNCES, _DIFFUSE_BOUNCES, _CLAMP_INDIRECT = 12, 4, 10.0
# Names of properties that set the detail of geometry in the viewport and in renders: of modifiers,
# and of the data of objects by type.
_DETAIL = (('levels', 'render_levels'), ('steps', 'render_steps'),
           ('viewport_resolution', 'resolution'))
_DATA_DETAIL = {'CURVE': ('resolution_u', 'render_resolution_u'),
                'SURFACE': ('resolution_u', 'render_resolution_u'),
                'FONT': ('resolution_u', 'render_resolution_u'),
                'META': ('resolution', 'render_resolution')}
NO_CAUSTICS = "its Shadow Caustics are not read: light goes straight on through glass"


def of_render_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Iterator[str]:
    """Yields warnings of settings of the scene, of its view layer and of Cycles that a bake
    ignores."""
    if scene.background_set is not None:
        yield (f'the background set "{scene.background_set.name}" is left out: link its objects to '
               f'the scene')
    if view_layer.material_override is not None:
        yield (f'the material override "{view_layer.material_override.name}" of the view layer is '
               f'not read: take it off to bake what Cycles bakes')
    cycles = getattr(scene, 'cycles', None)
    if cycles is None:
        return
    if cycles.film_exposure > 0.0 and abs(cycles.film_exposure - 1.0) > 1e-6:
        yield (f"Cycles multiplies what it bakes by the film's Exposure of "
               f"{cycles.film_exposure:.3g}: for the same values set exposure to "
               f"{math.log2(cycles.film_exposure):.3g}")
    if cycles.use_fast_gi:
        yield ("Fast GI Approximation is not read: reflected light is computed in full; switch it "
               "off to compare with Cycles")
    bounces = min(cycles.max_bounces, cycles.diffuse_bounces)
    if cycles.max_bounces < _BOUNCES or cycles.diffuse_bounces < _DIFFUSE_BOUNCES:
        yield (f"Cycles reflects diffuse light {bounces} times at most, here it is reflected "
               f"without end: raise the Max Bounces of the light paths to compare")
    if cycles.sample_clamp_direct > 0.0 or 0.0 < cycles.sample_clamp_indirect < _CLAMP_INDIRECT:
        yield ("Cycles clamps its samples, which takes light away: set the clamping of the light "
               "paths to 0 to compare")
    if scene.render.use_simplify and (cycles.use_camera_cull or cycles.use_distance_cull):
        yield ("Simplify leaves out objects by their distance or the camera in Cycles; here all "
               "take part: hide them in renders instead")


def of_world(world: bpy.types.World | None) -> Iterator[str]:
    """Yields warnings of features of the world that a bake ignores."""
    tree = world.node_tree if world is not None else None
    # From 5.0 on, every world has nodes, and use_nodes only warns.
    if tree is None or bpy.app.version < (5, 0, 0) and not world.use_nodes:
        return
    output = output_node(tree)
    if getattr(getattr(world, 'cycles', None), 'is_caustics_light', False):
        yield f'world "{world.name}": {NO_CAUSTICS}'
    if output is not None and output.inputs['Volume'].is_linked:
        yield (f'world "{world.name}": its volume neither dims nor scatters light here: unlink it '
               f'to compare with Cycles')


def of_materials(scene: bpy.types.Scene, materials: Iterable[tuple[bpy.types.Material, bool]]
                 ) -> Iterator[str]:
    """Yields warnings of features of materials that a bake ignores. materials: original materials,
    each with whether light passes straight through it."""
    turned, glassy = [], []
    for material, is_transparent in materials:
        output = output_node(material.node_tree) if material.node_tree is not None else None
        if output is None or bpy.app.version < (5, 0, 0) and not material.use_nodes:
            continue
        if output.inputs['Displacement'].is_linked and _displacement(material) != 'BUMP':
            yield (f'material "{material.name}": its displacement does not move the surface here: '
                   f'use a Displace modifier, or apply it to the mesh')
        if any(_turns_normals(node) for node in _nodes(material.node_tree)):
            turned.append(f'"{material.name}"')
        if output.inputs['Volume'].is_linked:
            yield (f'material "{material.name}": its volume neither dims nor scatters light here; '
                   f'where it has no surface light passes as through air')
        if is_transparent and any(_is_glass(node) for node in _nodes(material.node_tree)):
            glassy.append(f'"{material.name}"')
    yield from _line_about(
        turned, "normal maps are not read, light is that of the surfaces without them",
        "unlink them to compare with Cycles")
    if not getattr(getattr(scene, 'cycles', None), 'caustics_refractive', True):
        yield from _line_about(
            glassy, "Refractive Caustics are off, by which glass stops reflected light in Cycles; "
                    "here it passes", "switch them on to compare")


def _line_about(owners: Iterable[str], what: str, remedy: str) -> Iterator[str]:
    """Yields one line that names the owners (quoted names), or no line if there are no owners."""
    owners = list(owners)
    if owners:
        yield f"{what}: {listed(owners)}: {remedy}"


def _quoted(names: Iterable[str]) -> list[str]:
    return [f'"{name}"' for name in names]


def _nodes(tree: bpy.types.NodeTree, seen: frozenset[str] = frozenset()
           ) -> Iterator[bpy.types.Node]:
    """Yields the nodes of a tree and of its groups. seen: full names of the groups that enclose the
    tree."""
    for node in tree.nodes:
        yield node
        group = getattr(node, 'node_tree', None)
        if group is not None and group.name_full not in seen:
            yield from _nodes(group, seen | {group.name_full})


def _turns_normals(node: bpy.types.Node) -> bool:
    """Returns whether a node changes shading normals in a way that Cycles' vertex bake shows. That
    bake does not show bumps."""
    if node.type == 'NORMAL_MAP':
        return not node.mute and any(output.is_linked for output in node.outputs)
    socket = node.inputs.get('Normal') if any(item.type == 'SHADER' for item in node.outputs) \
        else None
    return socket is not None and any(link.from_node.type not in ('BUMP', 'NORMAL_MAP')
                                      for link in socket.links)


def _is_glass(node: bpy.types.Node) -> bool:
    """Returns whether a shader refracts light."""
    if node.type != 'BSDF_PRINCIPLED':
        return node.type in ('BSDF_GLASS', 'BSDF_REFRACTION')
    # The socket was renamed in 4.0.
    socket = node.inputs.get('Transmission Weight') or node.inputs.get('Transmission')
    return socket.is_linked or socket.default_value > 0.0


def _setting(owner: bpy.types.ID, name: str, usual: object) -> object:
    """Returns a setting that belongs to Cycles or, in later versions, to Blender itself. Returns
    `usual` if neither has it."""
    # Read the original, because changes of Cycles' settings by scripts do not reach the evaluated
    # owner.
    cycles = getattr(owner.original, 'cycles', None)
    return getattr(cycles, name, getattr(owner, name, usual))


def _displacement(material: bpy.types.Material) -> str:
    return _setting(material, 'displacement_method', 'BUMP')


def of_objects(items: Iterable[bpy.types.Object]) -> Iterator[str]:
    """Yields warnings of features of objects that a bake ignores. items: original objects that are
    part of the bake."""
    differing = []
    for item in items:
        yield from _of_hair(item)
        if getattr(getattr(item, 'cycles', None), 'shadow_terminator_offset', 0.0) > 0.0:
            yield (f'"{item.name}": Shading Offset of its shadow terminator is not read: set it to '
                   f'0 to compare with Cycles')
        differing += [f'"{item.name}" ({how})' for how in _differences(item)]
    yield from _line_about(
        differing, "geometry is as the viewport shows it, and not as renders do",
        "make both alike")


def _of_hair(item: bpy.types.Object) -> Iterator[str]:
    """Yields warnings of hair of particle systems that renders show."""
    for modifier in item.modifiers:
        if modifier.type != 'PARTICLE_SYSTEM' or not modifier.show_render:
            continue
        system = modifier.particle_system
        settings = system.settings
        has_strands = settings.count > 0 or system.is_edited
        if settings.type == 'HAIR' and settings.render_type == 'PATH' and has_strands:
            yield (f'"{item.name}": the strands of its particle system "{system.name}" neither '
                   f'block nor reflect light here: convert them to a mesh with thickness')


def _differences(item: bpy.types.Object) -> Iterator[str]:
    """Yields the differences of the object's geometry between viewport and renders, each in a few
    words."""
    for modifier in item.modifiers:
        if modifier.show_viewport != modifier.show_render:
            yield f'{modifier.name} is on in one of them'
        elif modifier.show_render:
            for shown, rendered in _DETAIL:
                values = [getattr(modifier, name, None) for name in (shown, rendered)]
                if None not in values and values[0] != values[1]:
                    yield f'{modifier.name}: {values[0]} and {values[1]} {shown}'
        if modifier.type == 'PARTICLE_SYSTEM' and modifier.show_render:
            settings = modifier.particle_system.settings
            if (settings.render_type in ('OBJECT', 'COLLECTION')
                    and settings.display_percentage < 100):
                yield f'{modifier.name}: {settings.display_percentage} % of its particles'
    if item.modifiers and (_setting(item, 'use_adaptive_subdivision', False) or any(
            getattr(modifier, 'use_adaptive_subdivision', False) for modifier in item.modifiers)):
        yield "adaptive subdivision"
    if item.type in _DATA_DETAIL:
        shown, rendered = (getattr(item.data, name) for name in _DATA_DETAIL[item.type])
        # A resolution of 0 in renders means that of the viewport.
        if rendered and shown != rendered:
            yield f'{_DATA_DETAIL[item.type][0]} {shown:.3g} and {rendered:.3g}'


def has_light_linking(item: bpy.types.Object) -> bool:
    """Returns whether light linking limits the objects that a lamp or an emissive object lights, or
    the objects that block its light. Light linking exists from Blender 4.0 on."""
    linking = getattr(item, 'light_linking', None)
    return bool(linking and (linking.receiver_collection or linking.blocker_collection))


def of_hidden(hidden: Iterable[bpy.types.Object], lights: Iterable[str]) -> Iterator[str]:
    """Yields warnings of objects that are hidden in the viewport but not in renders. hidden:
    original objects with surfaces, which are left out. lights: names of lamps, which are part of
    the bake."""
    yield from _line_about(
        _quoted(dict.fromkeys(lights)),
        "lights that are hidden in the viewport shine, as in Cycles",
        "disable them in renders to switch them off")
    yield from _line_about(
        _quoted(item.name for item in hidden),
        "what is hidden in the viewport is left out, though Cycles renders it",
        "show it, or disable it in renders as well")


def of_unrendered(unrendered: Iterable[bpy.types.Object]) -> Iterator[str]:
    """Yields warnings of objects that are shown in the viewport but not in renders. They are left
    out. unrendered: original objects. Objects that are drawn as wires or bounds, such as cutters of
    Boolean modifiers, are not named."""
    yield from _line_about(
        _quoted(item.name for item in unrendered if item.display_type in ('SOLID', 'TEXTURED')),
        "what is hidden in renders is left out, as by Cycles", "enable it in renders to bake it")


def of_modifiers(copied: Iterable[str], untraced: Iterable[str]) -> Iterator[str]:
    """Yields warnings of modifiers that prevent an exact assignment of results to the original mesh
    (corner_map.py). copied: names of objects whose modifiers create several corners from one.
    untraced: names of objects whose modifiers do not keep the codes of some corners."""
    yield from _line_about(
        _quoted(copied),
        "modifiers make several faces of one, and all show the light of that in its place",
        "apply the modifiers to light each by itself")
    yield from _line_about(
        _quoted(untraced),
        "modifiers keep no trace of some corners, which have the light of what lies nearest",
        "apply the modifiers for their own")


def of_normals(turned: Iterable[str]) -> Iterator[str]:
    """Yields warnings of custom normals. turned: names of objects whose custom normals differ from
    the orientation of the faces."""
    yield from _line_about(
        _quoted(turned),
        "custom normals that turn faces are not followed, light falls on the faces as they lie",
        "clear the custom split normals to compare with Cycles")
