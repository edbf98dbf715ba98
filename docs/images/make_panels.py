# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pictures of panels and of a running bake in docs/user_guide.md, in a window.

    LIBGL_ALWAYS_SOFTWARE=1 xvfb-run -a -s "-screen 0 1280x1400x24" \\
        blender --factory-startup --window-geometry 0 0 1280 1400 \\
        -P docs/images/make_panels.py -- OUT_DIR

The picture in German needs a Blender with languages.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blend_tests")]

import raybundle  # noqa: E402
import ui_test  # noqa: E402
from raybundle import bake_run  # noqa: E402
from ui_window import MAIN  # noqa: E402

PAUSE = 0.5  # s, in which Blender draws
# Widths of the editor of properties, as share of the window.
WIDE, NARROW = 0.36, 0.2
# The later picture of a running bake: finished share, and pixels of the panel's upper part.
SHARE, RUNNING_ROWS = 0.6, 240


def show_panel() -> None:
    """Leaves only Raybundle's panels in the Render properties."""
    for panel in list(bpy.types.Panel.__subclasses__()):
        if (getattr(panel, 'bl_space_type', '') == 'PROPERTIES'
                and getattr(panel, 'bl_context', '') == 'render'
                and not panel.__name__.startswith('RAYBUNDLE') and panel.is_registered):
            bpy.utils.unregister_class(panel)


def editor() -> bpy.types.Area:
    """Returns the editor of properties that the pictures show, the one that was added last."""
    return min((area for area in MAIN.window.screen.areas if area.type == 'PROPERTIES'),
               key=lambda area: area.x)


def largest_view() -> bpy.types.Area:
    return max((area for area in MAIN.window.screen.areas if area.type == 'VIEW_3D'),
               key=lambda area: area.width)


def region_of(area: bpy.types.Area) -> bpy.types.Region:
    return next(region for region in area.regions if region.type == 'WINDOW')


def show_editor(width: float) -> Iterator[float]:
    """Divides the 3D view, so that its right part is an editor of properties of this width. Yields
    pauses, s."""
    view = largest_view()
    with bpy.context.temp_override(window=MAIN.window, area=view):
        bpy.ops.screen.area_split(direction='VERTICAL',
                                  factor=1.0 - width * MAIN.window.width / view.width)
    yield PAUSE  # Its areas have their places only after it was drawn.
    right = max((area for area in MAIN.window.screen.areas if area.type == 'VIEW_3D'),
                key=lambda area: area.x)
    right.type = 'PROPERTIES'
    yield PAUSE  # Its tabs exist only after it was drawn.
    right.spaces.active.context = 'RENDER'


def save(path: Path) -> None:
    """Saves a picture of the editor's panels, cut off below the last one."""
    pixels = MAIN.picture(path)
    region = region_of(editor())
    inside = pixels[region.y:region.y + region.height, region.x:region.x + region.width]
    # Rows from the bottom, without the border of the region and the scroll bar.
    border = 8
    drawn = (np.abs(inside[border:, border:-16] - inside[border, border]) > 0.01).any(axis=(1, 2))
    write_picture(path, inside[int(drawn.argmax()):])


def write_picture(path: Path, inside: np.ndarray) -> None:
    """Writes a PNG file of pixels, (height, width, 3) in 0..1, bottom row first."""
    colors = np.ones((*inside.shape[:2], 4), np.float32)
    colors[:, :, :3] = inside
    image = bpy.data.images.new(path.stem, colors.shape[1], colors.shape[0])
    image.pixels.foreach_set(colors.ravel())
    image.filepath_raw, image.file_format = str(path), 'PNG'
    image.save()
    bpy.data.images.remove(image)


def bake(scene: str, **settings: object) -> Iterator[float]:
    """Opens a scene, keeps the screen, and bakes. Yields pauses, s."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "scenes" / f"{scene}.blend"), load_ui=False)
    yield PAUSE
    for name, value in settings.items():
        setattr(bpy.context.scene.raybundle, name, value)
    raybundle.bake(bpy.context)
    yield PAUSE


def picture_running_bake(out: Path) -> Iterator[float]:
    """Makes pictures of the 3D view at the first light of a bake and later, and of the panel
    later. Yields pauses, s."""
    yield from bake("office", quality='DRAFT')
    view = largest_view()
    view.spaces.active.region_3d.view_perspective = 'CAMERA'
    space = view.spaces.active
    space.overlay.show_overlays = space.show_gizmo = space.show_region_toolbar = False
    space.show_region_header = space.show_region_tool_header = False
    yield PAUSE
    bpy.context.scene.raybundle.quality = 'FINAL'
    run = start_bake(view)
    while not run.shows_light:
        yield 0.01
    write_picture(out / "view_first_light.png", camera_frame(MAIN.picture(
        out / "view_first_light.png"), region_of(view)))
    bpy.ops.raybundle.stop()
    yield PAUSE
    # Another bake, because the first picture takes so long that it delays the next light.
    run = start_bake(view)
    while run.progress.fraction < SHARE:
        yield 0.05
    pixels = MAIN.picture(out / "panel_running.png")
    write_picture(out / "view_later_light.png", camera_frame(pixels, region_of(view)))
    region = region_of(editor())
    top = region.y + region.height
    write_picture(out / "panel_running.png",
                  pixels[top - RUNNING_ROWS:top, region.x:region.x + region.width])
    bpy.ops.raybundle.stop()
    yield PAUSE


def start_bake(view: bpy.types.Area) -> bake_run.BakeRun:
    """Starts a bake as a button in a 3D view does."""
    with bpy.context.temp_override(window=MAIN.window, area=view, region=region_of(view)):
        bpy.ops.raybundle.bake('INVOKE_DEFAULT')
    return bake_run.active()


def camera_frame(pixels: np.ndarray, region: bpy.types.Region) -> np.ndarray:
    """Returns the part of a picture of the window that shows what the camera sees, in a region
    that is narrower than the camera's picture."""
    render = bpy.context.scene.render
    half = int(0.5 * region.width * render.resolution_y / render.resolution_x)
    middle = region.y + region.height // 2
    return pixels[middle - half:middle + half, region.x:region.x + region.width]


def steps(out: Path) -> Iterator[float]:
    """Makes all pictures. Yields the pauses between the steps, s."""
    show_panel()
    yield from show_editor(WIDE)
    yield from bake("house_on_plain", quality='DRAFT')
    save(out / "panel.png")
    view = bpy.context.preferences.view
    view.language = "de_DE"
    view.use_translate_interface = True
    yield from bake("cornell_box")
    save(out / "panel_german.png")
    view.language = "en_US"
    yield from picture_running_bake(out)
    yield from show_editor(NARROW)
    yield from bake("house_on_plain", quality='DRAFT')
    save(out / "panel_narrow.png")


def main(out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    bpy.context.preferences.view.show_splash = False
    raybundle.register()
    ui_test.run(steps(out), out)


if __name__ == "__main__":
    main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
