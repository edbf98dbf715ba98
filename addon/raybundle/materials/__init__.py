# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's materials, read as what a radiosity bake needs to know of a surface.

A bake needs, for each of the two sides of a surface: the share of the light that the surface
reflects (its reflectance), which part of that is mirrored by gloss and how both depend on the
angle of the light, what passes through it, and what it emits. The way through the package follows
a material from its nodes to these numbers:

1. export.py: `MaterialExporter`, the only entrance for scene_export.py, turns each material slot
   into one `MaterialData` of scene_data.py.
2. node_reader.py: `NodeReader` reads the shaders of a node tree and returns a `Surface`. It
   derives from the `ColorReader` of color_reader.py, which reads the colours and values that are
   linked to shaders; node_links.py follows the links. Lamps and the world have node trees too and
   are read by the same class.
3. surface.py: `Surface`, one side of a material. Its colours are those of color_expression.py, a
   constant plus a weighted image plus a weighted attribute. scattering.py holds in which
   directions the reflected light leaves.
4. The reflection models of Cycles, each as numbers for the terms of diffuse_angles.py (rough
   diffuse surfaces): gloss.py (microfacets), layers.py (sheen, velvet, clearcoat), and
   principled.py, which combines them for the Principled shader, by Blender version.
5. Node trees that cannot be read this way are rendered by Cycles into images: cycles_bake.py bakes
   a copy of the object, whose materials shader_colors.py has rewritten and whose faces
   face_atlas.py has laid out. fingerprint.py tells whether an earlier image is still valid.
6. Materials that show the result of an earlier bake: shown_results.py recognises such nodes, and
   last_surfaces.py keeps what the slot's own material was.
"""
