"""Furniture as shapes. Each piece stands on z = 0 at the origin and consists of closed solids."""

from __future__ import annotations

from .construction import Shape, box, cylinder, join


def table(width: float, depth: float, height: float, cells: tuple[int, int] = (1, 1)) -> Shape:
    """Returns a table with a top on four legs. ``cells`` are the numbers of cells of the top."""
    top, leg = 0.05, 0.08
    x, y = width / 2 - leg, depth / 2 - leg
    legs = [box((leg, leg, height - top), at=(sx * x, sy * y, 0))
            for sx in (-1, 1) for sy in (-1, 1)]
    return join([box((width, depth, top), (*cells, 1), at=(0, 0, height - top))] + legs)


def chair() -> Shape:
    """Returns a chair that faces -y. Its back is at +y."""
    seat, leg, height, thick = 0.45, 0.05, 0.45, 0.04
    reach = seat / 2 - leg / 2
    legs = [box((leg, leg, height - thick), at=(sx * reach, sy * reach, 0))
            for sx in (-1, 1) for sy in (-1, 1)]
    return join([box((seat, seat, thick), at=(0, 0, height - thick)),
                 box((seat, thick, 0.5), at=(0, seat / 2 - thick / 2, height))] + legs)


def desk(width: float, depth: float) -> Shape:
    """Returns a desk: a top, two side panels, and a modesty panel at +y."""
    height, thick = 0.74, 0.04
    side = box((thick, depth - 0.1, height - thick), (1, 2, 2))
    return join([
        box((width, depth, thick), (4, 2, 1), at=(0, 0, height - thick)),
        side.moved((-width / 2 + 0.1, 0, 0)),
        side.moved((width / 2 - 0.1, 0, 0)),
        box((width - 0.24, 0.02, 0.4), (4, 1, 1), at=(0, depth / 2 - 0.1, 0.3)),
    ])


def shelf(width: float, depth: float, height: float, boards: int) -> Shape:
    """Returns an open shelf: two sides and boards between them, the lowest one on the floor."""
    thick = 0.03
    inner = width - 2 * thick
    rise = (height - thick) / (boards - 1)
    sides = [box((thick, depth, height), (1, 1, 4), at=(sx * (width - thick) / 2, 0, 0))
             for sx in (-1, 1)]
    return join(sides + [box((inner, depth, thick), (3, 1, 1), at=(0, 0, rise * level))
                         for level in range(boards)])


def monitor() -> Shape:
    """Returns a monitor that faces -y. Slot 1 is its screen."""
    return join([box((0.24, 0.18, 0.02)), box((0.05, 0.03, 0.12), at=(0, 0.02, 0.02)),
                 box((0.56, 0.03, 0.34), (2, 1, 2), at=(0, 0, 0.12), slots={"south": 1})])


def hanging_lamp(drop: float, sides: int = 12) -> Shape:
    """Returns a lamp that hangs from z = 0 by a rod. Slot 1, its lower end, faces the floor."""
    hood = 0.12
    return join([box((0.02, 0.02, drop - hood), at=(0, 0, -drop + hood)),
                 cylinder(0.25, hood, sides, at=(0, 0, -drop), bottom_slot=1)])


def floor_lamp(height: float, sides: int = 12) -> Shape:
    """Returns a free-standing lamp. Slot 1, its upper end, faces the ceiling."""
    foot, hood = 0.03, 0.12
    return join([cylinder(0.18, foot, sides),
                 box((0.03, 0.03, height - hood - foot), at=(0, 0, foot)),
                 cylinder(0.25, hood, sides, at=(0, 0, height - hood), top_slot=1)])
