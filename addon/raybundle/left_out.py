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
from .messages import Message, quoted
from .warning_lines import listed

# Types of objects that a bake leaves out, and the warning for each.
UNREAD_TYPES = {
    'CURVES': Message("hair curves neither block nor reflect light in a bake: convert them to a "
                      "mesh with thickness"),
    'POINTCLOUD': Message("point clouds neither block nor reflect light in a bake: instance "
                          "spheres on the points, or convert the points to a mesh"),
    'VOLUME': Message("volumes neither absorb nor scatter light in a bake: convert the volume to a "
                      "mesh, or disable it in renders to compare with Cycles"),
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
NO_LINKING = Message("Raybundle ignores light linking: the light reaches all objects, and all "
                     "objects block it; use light sets instead")
NO_CAUSTICS = Message("Raybundle ignores Shadow Caustics: light passes straight through glass")


def of_render_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Iterator[str]:
    """Yields warnings of settings of the scene, of its view layer and of Cycles that a bake
    ignores."""
    if scene.background_set is not None:
        yield Message("Raybundle leaves out the background set {scene}: to bake with its objects, "
                      "link them to the scene", scene=quoted(scene.background_set.name))
    if view_layer.material_override is not None:
        yield Message("Raybundle ignores the material override {material} of the view layer: "
                      "remove the override to compare with Cycles",
                      material=quoted(view_layer.material_override.name))
    cycles = getattr(scene, 'cycles', None)
    if cycles is None:
        return
    if cycles.film_exposure > 0.0 and abs(cycles.film_exposure - 1.0) > 1e-6:
        yield Message("Cycles multiplies its baked values by the film Exposure of {exposure}, "
                      "Raybundle does not: for the same values, set Raybundle's exposure to "
                      "{stops}",
                      exposure=f"{cycles.film_exposure:.3g}",
                      stops=f"{math.log2(cycles.film_exposure):.3g}")
    if cycles.use_fast_gi:
        yield Message("Raybundle ignores Fast GI Approximation and computes all reflected light: "
                      "switch Fast GI Approximation off to compare with Cycles")
    bounces = min(cycles.max_bounces, cycles.diffuse_bounces)
    if cycles.max_bounces < _BOUNCES or cycles.diffuse_bounces < _DIFFUSE_BOUNCES:
        yield Message("Cycles reflects diffuse light at most {count} times, Raybundle without "
                      "limit: raise Total and Diffuse under Light Paths, Max Bounces to compare",
                      count=bounces)
    if cycles.sample_clamp_direct > 0.0 or 0.0 < cycles.sample_clamp_indirect < _CLAMP_INDIRECT:
        yield Message("Cycles clamps its samples, which removes light: set Direct Light and "
                      "Indirect Light under Light Paths, Clamping to 0 to compare")
    if scene.render.use_simplify and (cycles.use_camera_cull or cycles.use_distance_cull):
        yield Message("Simplify culls objects by camera or distance in Cycles, but not in "
                      "Raybundle: disable these objects in renders instead")


def of_world(world: bpy.types.World | None) -> Iterator[str]:
    """Yields warnings of features of the world that a bake ignores."""
    tree = world.node_tree if world is not None else None
    # From 5.0 on, every world has nodes, and use_nodes only warns.
    if tree is None or bpy.app.version < (5, 0, 0) and not world.use_nodes:
        return
    output = output_node(tree)
    if getattr(getattr(world, 'cycles', None), 'is_caustics_light', False):
        yield Message("world {name}: {what}", name=quoted(world.name), what=NO_CAUSTICS)
    if output is not None and output.inputs['Volume'].is_linked:
        yield Message("world {name}: its volume neither absorbs nor scatters light in a bake: "
                      "unlink the volume to compare with Cycles", name=quoted(world.name))


def of_materials(scene: bpy.types.Scene, materials: Iterable[tuple[bpy.types.Material, bool]]
                 ) -> Iterator[str]:
    """Yields warnings of features of materials that a bake ignores. materials: original materials,
    each with whether light passes straight through it."""
    turned, glassy = [], []
    for material, is_transparent in materials:
        output = output_node(material.node_tree) if material.node_tree is not None else None
        if output is None or bpy.app.version < (5, 0, 0) and not material.use_nodes:
            continue
        name = quoted(material.name)
        if output.inputs['Displacement'].is_linked and _displacement(material) != 'BUMP':
            yield Message("material {name}: its displacement does not move the surface in a bake: "
                          "use a Displace modifier, or apply the displacement to the mesh",
                          name=name)
        if any(_turns_normals(node) for node in _nodes(material.node_tree)):
            turned.append(name)
        if output.inputs['Volume'].is_linked:
            yield Message("material {name}: its volume neither absorbs nor scatters light in a "
                          "bake, and a material without a surface lets all light pass: unlink the "
                          "volume to compare with Cycles", name=name)
        if is_transparent and any(_is_glass(node) for node in _nodes(material.node_tree)):
            glassy.append(name)
    if turned:
        yield Message("Raybundle ignores normal maps and linked normals. Materials: {names}. "
                      "Unlink the normals to compare with Cycles", names=listed(turned))
    if glassy and not getattr(getattr(scene, 'cycles', None), 'caustics_refractive', True):
        yield Message("Refractive Caustics are off, so that glass blocks reflected light in "
                      "Cycles, but not in Raybundle. Materials: {names}. Switch Refractive "
                      "Caustics on to compare", names=listed(glassy))


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
            yield Message("{name}: Raybundle ignores the Shading Offset of the shadow terminator: "
                          "set it to 0 to compare with Cycles", name=quoted(item.name))
        differing += [Message("{name} ({how})", name=quoted(item.name), how=how)
                      for how in _differences(item)]
    if differing:
        yield Message("The viewport and renders show different geometry, and Raybundle bakes that "
                      "of the viewport. Objects: {names}. Use the same settings for both",
                      names=listed(differing))


def _of_hair(item: bpy.types.Object) -> Iterator[str]:
    """Yields warnings of hair of particle systems that renders show."""
    for modifier in item.modifiers:
        if modifier.type != 'PARTICLE_SYSTEM' or not modifier.show_render:
            continue
        system = modifier.particle_system
        settings = system.settings
        has_strands = settings.count > 0 or system.is_edited
        if settings.type == 'HAIR' and settings.render_type == 'PATH' and has_strands:
            yield Message("{name}: the strands of its particle system {system} neither block nor "
                          "reflect light in a bake: convert the strands to a mesh with thickness",
                          name=quoted(item.name), system=quoted(system.name))


def _differences(item: bpy.types.Object) -> Iterator[str]:
    """Yields the differences of the object's geometry between viewport and renders, each in a few
    words."""
    for modifier in item.modifiers:
        if modifier.show_viewport != modifier.show_render:
            yield Message("{name}: only in viewport" if modifier.show_viewport else
                          "{name}: only in renders", name=modifier.name)
        elif modifier.show_render:
            for shown, rendered in _DETAIL:
                values = [getattr(modifier, name, None) for name in (shown, rendered)]
                if None not in values and values[0] != values[1]:
                    yield Message("{name}: {setting} {shown} in viewport, {rendered} in renders",
                                  name=modifier.name, setting=shown.removeprefix("viewport_"),
                                  shown=values[0], rendered=values[1])
        if modifier.type == 'PARTICLE_SYSTEM' and modifier.show_render:
            settings = modifier.particle_system.settings
            if (settings.render_type in ('OBJECT', 'COLLECTION')
                    and settings.display_percentage < 100):
                yield Message("{name}: {percent} % of the particles in viewport",
                              name=modifier.name, percent=settings.display_percentage)
    if item.modifiers and (_setting(item, 'use_adaptive_subdivision', False) or any(
            getattr(modifier, 'use_adaptive_subdivision', False) for modifier in item.modifiers)):
        yield Message("adaptive subdivision")
    if item.type in _DATA_DETAIL:
        shown, rendered = (getattr(item.data, name) for name in _DATA_DETAIL[item.type])
        # A resolution of 0 in renders means that of the viewport.
        if rendered and shown != rendered:
            yield Message("{setting} {shown} in viewport, {rendered} in renders",
                          setting=_DATA_DETAIL[item.type][0], shown=f"{shown:.3g}",
                          rendered=f"{rendered:.3g}")


def has_light_linking(item: bpy.types.Object) -> bool:
    """Returns whether light linking limits the objects that a lamp or an emissive object lights, or
    the objects that block its light. Light linking exists from Blender 4.0 on."""
    linking = getattr(item, 'light_linking', None)
    return bool(linking and (linking.receiver_collection or linking.blocker_collection))


def of_hidden(hidden: Iterable[bpy.types.Object], lights: Iterable[str]) -> Iterator[str]:
    """Yields warnings of objects that are hidden in the viewport but not in renders. hidden:
    original objects with surfaces, which are left out. lights: names of lamps, which are part of
    the bake."""
    if names := [quoted(name) for name in dict.fromkeys(lights)]:
        yield Message("Lights that are hidden only in the viewport give light, as in Cycles. "
                      "Lights: {names}. Disable them in renders to switch them off",
                      names=listed(names))
    if names := [quoted(item.name) for item in hidden]:
        yield Message("Raybundle leaves out objects that are hidden in the viewport, but Cycles "
                      "renders them. Objects: {names}. Show them in the viewport, or disable them "
                      "in renders too", names=listed(names))


def of_unrendered(unrendered: Iterable[bpy.types.Object]) -> Iterator[str]:
    """Yields warnings of objects that are shown in the viewport but not in renders. They are left
    out. unrendered: original objects. Objects that are drawn as wires or bounds, such as cutters of
    Boolean modifiers, are not named."""
    names = [quoted(item.name) for item in unrendered
             if item.display_type in ('SOLID', 'TEXTURED')]
    if names:
        yield Message("Raybundle leaves out objects that are hidden in renders, as Cycles does. "
                      "Objects: {names}. Enable them in renders to bake them", names=listed(names))


def of_modifiers(copied: Iterable[str], untraced: Iterable[str]) -> Iterator[str]:
    """Yields warnings of modifiers that prevent an exact assignment of results to the original mesh
    (corner_map.py). copied: names of objects whose modifiers create several corners from one.
    untraced: names of objects whose modifiers do not keep the codes of some corners."""
    if names := [quoted(name) for name in copied]:
        yield Message("Modifiers copy faces, and all copies show the light of the one nearest to "
                      "the original face. Objects: {names}. Apply the modifiers to give each copy "
                      "its own light", names=listed(names))
    if names := [quoted(name) for name in untraced]:
        yield Message("Modifiers keep no trace of some corners, which get the light of the nearest "
                      "surface. Objects: {names}. Apply the modifiers to give each corner its own "
                      "light", names=listed(names))


def of_normals(turned: Iterable[str]) -> Iterator[str]:
    """Yields warnings of custom normals. turned: names of objects whose custom normals differ from
    the orientation of the faces."""
    if names := [quoted(name) for name in turned]:
        yield Message("Raybundle computes light with the normals of the faces and ignores custom "
                      "normals that differ from them. Objects: {names}. Clear the custom split "
                      "normals to compare with Cycles", names=listed(names))
