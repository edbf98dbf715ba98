# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the animated picture of live light in README.md: a lamp is dragged in Blender's window.

    xvfb-run -a -s "-screen 0 640x480x24" \\
        /usr/bin/python3 docs/images/make_live_light.py docs/images/live_light.gif \\
        [--blender blender] [--frames 36] [--seconds 4] [--faster 1]

Needs xdotool and python3-pil. Starts Blender with this script, which shows the scene cornell_box
with a point lamp in place of its lamp, in live mode. Then drags the lamp once around with the mouse
within --seconds, and takes up to --frames pictures of the screen meanwhile. The animation is
--faster times as fast as the drag.
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENE = ROOT / "scenes" / "cornell_box.blend"
# Pixels of the window, which Blender does not make smaller, and of the animation, whose pictures
# are the middle of the window.
WINDOW, SIZE = (640, 480), 320
READY = "live light at"  # Blender prints it, with the place of the lamp on the screen

# The lamp: its place, m, in front of the boxes; radius, m; power, W.
PLACE, RADIUS, POWER = (0.0, -0.35, 1.62), 0.04, 20.0
# Half axes of the path of the mouse, pixels.
ACROSS, DOWN = 105, 65
COLORS = 192


# --------------------------------------------------------------------------------------------------
# In Blender
# --------------------------------------------------------------------------------------------------


def show_scene() -> None:
    """Shows the scene in the whole window, with live mode on and the lamp selected."""
    import bpy
    from bpy_extras.view3d_utils import location_3d_to_region_2d
    sys.path.insert(0, str(ROOT / "addon"))
    sys.dont_write_bytecode = True
    import raybundle
    raybundle.register()
    # Software OpenGL would draw each picture eight times.
    bpy.context.preferences.system.viewport_aa = 'FXAA'
    bpy.ops.wm.open_mainfile(filepath=str(SCENE))
    bpy.data.objects.remove(bpy.data.objects["lamp"])
    light = bpy.data.lights.new("lamp", 'POINT')
    light.shadow_soft_size, light.energy = RADIUS, POWER
    lamp = bpy.data.objects.new("lamp", light)
    lamp.location = PLACE
    bpy.context.scene.collection.objects.link(lamp)
    bpy.context.view_layer.objects.active = lamp
    lamp.select_set(True)
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == 'VIEW_3D')
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.screen.screen_full_area(use_hide_panels=True)

    def view() -> bpy.types.Area:
        return next(area for area in window.screen.areas if area.type == 'VIEW_3D')

    def arrange() -> None:
        space = view().spaces.active
        space.region_3d.view_camera_zoom = 29.0  # the camera's picture fills the window
        space.region_3d.view_camera_offset = (0.0, 0.0)
        space.show_gizmo = space.show_region_header = space.show_region_toolbar = False
        space.show_region_tool_header = False
        for name in ("floor", "axis_x", "axis_y", "cursor", "text", "outline_selected"):
            setattr(space.overlay, f"show_{name}", False)
        bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y
        bpy.context.scene.raybundle.show_in = 'MATERIALS'
        bpy.context.scene.raybundle.live = True
        bpy.app.timers.register(wait, first_interval=1.0)

    began = time.monotonic()

    def wait() -> float | None:
        from raybundle import bake_run
        if bake_run.active() is not None or not bpy.context.scene.raybundle.report:
            return 0.5
        if time.monotonic() - began < 25.0:
            return 0.5  # Blender compiles the shaders of the materials
        region = next(region for region in view().regions if region.type == 'WINDOW')
        place = location_3d_to_region_2d(region, view().spaces.active.region_3d, lamp.location)
        print(READY, region.x + int(place.x), window.height - 1 - region.y - int(place.y),
              flush=True)
        return None

    bpy.app.timers.register(arrange, first_interval=1.0)


# --------------------------------------------------------------------------------------------------
# Beside Blender
# --------------------------------------------------------------------------------------------------


def mouse(*arguments: object) -> None:
    subprocess.run(["xdotool", *map(str, arguments)], check=True)


def record(x: int, y: int, frames: int, seconds: float) -> list[tuple[float, object]]:
    """Drags the lamp from x, y on the screen once around. Returns up to `frames` pictures of the
    screen with the times until the next one, s."""
    from PIL import ImageGrab
    mouse("mousemove", x, y)
    time.sleep(1.0)
    mouse("key", "g")
    time.sleep(1.0)
    middle = ((WINDOW[0] - WINDOW[1]) // 2, 0, (WINDOW[0] + WINDOW[1]) // 2, WINDOW[1])
    times, pictures = [], []
    began = time.monotonic()
    while (now := time.monotonic() - began) < seconds:
        angle = 2.0 * math.pi * now / seconds
        mouse("mousemove", x + int(ACROSS * math.sin(angle)),
              y + int(DOWN * (1.0 - math.cos(angle))))
        if not times or now >= times[-1] + seconds / frames:
            times.append(now)
            pictures.append(ImageGrab.grab(middle, xdisplay=os.environ["DISPLAY"]))
        time.sleep(0.03)
    mouse("click", 1)
    return [(end - start, picture)
            for start, end, picture in zip(times, [*times[1:], seconds], pictures)]


def write(pictures: list[tuple[float, object]], path: Path, faster: float) -> None:
    """Writes an animation, each picture with its own palette."""
    from PIL import Image
    # Without dithering, which would move from picture to picture and make the file larger.
    first, *others = (picture.resize((SIZE, SIZE), Image.Resampling.LANCZOS).quantize(
        COLORS, kmeans=2, dither=Image.Dither.NONE) for _, picture in pictures)
    first.save(path, save_all=True, append_images=others, loop=0, optimize=False,
               duration=[1000.0 * seconds / faster for seconds, _ in pictures])


def main() -> None:
    parser = argparse.ArgumentParser(prog="make_live_light.py")
    parser.add_argument("file", type=Path)
    parser.add_argument("--blender", default="blender")
    parser.add_argument("--frames", type=int, default=36)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--faster", type=float, default=1.0)
    options = parser.parse_args()
    blender = subprocess.Popen(
        [options.blender, "--factory-startup", "--window-geometry", "0", "0", *map(str, WINDOW),
         "-P", __file__], env={**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"},
        stdout=subprocess.PIPE, text=True)
    try:
        line = next(line for line in blender.stdout if line.startswith(READY))
        x, y = map(int, line.removeprefix(READY).split())
        pictures = record(x, y, options.frames, options.seconds)
    finally:
        blender.kill()
    write(pictures, options.file, options.faster)


if __name__ == "__main__":
    show_scene() if "bpy" in sys.modules else main()
