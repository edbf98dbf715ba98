# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts Blender's materials to the properties that a radiosity bake uses.

For each of the two sides of a surface a bake uses the reflectance (the share of the light that the
surface reflects), the glossy part of the reflectance, the dependence of both on the angle of the
light, the light that passes through, and the emission. The modules follow a material from its nodes
to these numbers:

1. export.py: `MaterialExporter`, the only entry point for scene_export.py, converts each material
   slot to one `MaterialData` of scene_data.py.
2. node_reader.py: `NodeReader` reads the shaders of a node tree and returns a `Surface`. It derives
   from the `ColorReader` of color_reader.py, which reads the colours and values that are linked to
   shaders. node_links.py follows the links. Lamps and the world also have node trees, which the
   same class reads.
3. surface.py: `Surface`, one side of a material. Its colours are those of color_expression.py: a
   constant plus a weighted image plus a weighted attribute. scattering.py describes the directions
   in which the reflected light leaves.
4. The reflection models of Cycles, as weights of the terms of diffuse_angles.py (which holds the
   models of rough diffuse surfaces): gloss.py (microfacets), layers.py (sheen, velvet, clearcoat),
   and principled.py, which combines the models for the Principled shader, by Blender version.
5. Cycles renders node trees that cannot be read in this way into images: cycles_bake.py bakes a
   copy of the object. shader_colors.py rewrites the materials of the copy, and face_atlas.py lays
   out its faces. fingerprint.py detects whether an earlier image is still valid.
6. Materials that show the result of an earlier bake: shown_results.py recognises nodes that read a
   result, and last_surfaces.py keeps the surface that the last bake used for the slot.
"""
