#!/usr/bin/env python3
"""A corpus in the manner of ShapeNet, made by rules: cars, chairs, lamps, planes, signs of letters, 500 models in all, of boxes, sheets and tubes that cross one
another, with what such files have: doubles, parts turned inside out, T-joints, gaps, inner parts and fragments.

    bench/corpus.py NUMBER OUT.obj      the model of this number, 0 to 499; the same bytes on every machine
"""
import sys

KINDS = ("car", "chair", "lamp", "plane", "sign")
COUNT = 500
ROUND = 16  # corners of a circle
# cosines and sines of a circle, in decimals, so that no machine's own are asked
CIRCLE = ((1.0, 0.0), (0.92388, 0.38268), (0.70711, 0.70711), (0.38268, 0.92388), (0.0, 1.0), (-0.38268, 0.92388), (-0.70711, 0.70711), (-0.92388, 0.38268),
          (-1.0, 0.0), (-0.92388, -0.38268), (-0.70711, -0.70711), (-0.38268, -0.92388), (0.0, -1.0), (0.38268, -0.92388), (0.70711, -0.70711), (0.92388, -0.38268))
LETTERS = {"E": "11110111", "F": "11100101", "H": "01111101", "L": "01010010", "T": "10000001", "U": "01111010"}  # bars: see Maker.letter


class Maker:
    """Grows a soup: positions, and polygons of them."""

    def __init__(self, number):
        self.state, self.positions, self.faces = number * 2 + 1, [], []
        for _ in range(8):
            self.random()

    def random(self):
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) % 2**64
        return (self.state >> 33) / 2**31

    def between(self, low, high):
        return low + (high - low) * self.random()

    def chance(self, share):
        return self.random() < share

    def add(self, positions, faces):
        first = len(self.positions)
        self.positions += [tuple(round(x, 6) for x in p) for p in positions]
        turned = self.chance(0.15)  # a part inside out
        self.faces += [tuple(first + i for i in (reversed(f) if turned else f)) for f in faces]

    def box(self, low, high, shear=0.0, without=()):
        """shear: the upper side is moved along x by so much; without: numbers of sides that are missing."""
        places = [(low[0] if i % 2 == 0 else high[0], low[1] if i // 2 % 2 == 0 else high[1], low[2] if i < 4 else high[2]) for i in range(8)]
        places = [(x + (shear if z == high[2] else 0), y, z) for x, y, z in places]
        sides = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
        self.add(places, [side for i, side in enumerate(sides) if i not in without])

    def sheet(self, corners, parts=1):
        """A quadrilateral without thickness, in so many strips; the strips beside it need not have its vertices: T-joints."""
        a, b, c, d = corners
        mix = lambda p, q, t: tuple(x + t * (y - x) for x, y in zip(p, q))  # noqa: E731
        rows = [(mix(a, b, i / parts), mix(d, c, i / parts)) for i in range(parts + 1)]
        self.add([p for row in rows for p in row], [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(parts)])

    def tube(self, centre, axis, radius, length, end=None, capped=True):
        """About an axis (0, 1, 2), from the centre on; end: the radius there."""
        end, u, v = radius if end is None else end, (axis + 1) % 3, (axis + 2) % 3
        places = []
        for r, along in ((radius, 0), (end, length)):
            for c, s in CIRCLE:
                p = list(centre)
                p[axis] += along
                p[u] += r * c
                p[v] += r * s
                places.append(tuple(p))
        faces = [(i, (i + 1) % ROUND, ROUND + (i + 1) % ROUND, ROUND + i) for i in range(ROUND)]
        if capped:
            faces += [tuple(range(ROUND - 1, -1, -1)), tuple(range(ROUND, 2 * ROUND))]
        self.add(places, faces)

    def letter(self, word, x, y, z, size, depth):
        """Bars: top, left, right, middle, left again, right again, bottom, stem; they overlap where they meet."""
        t = 0.22 * size
        bars = [((0, 0.78), (0.7, 1)), ((0, 0.5), (0.22, 1)), ((0.48, 0.5), (0.7, 1)), ((0, 0.4), (0.7, 0.6)),
                ((0, 0), (0.22, 0.55)), ((0.48, 0), (0.7, 0.55)), ((0, 0), (0.7, 0.22)), ((0.24, 0), (0.46, 0.9))]
        for used, (low, high) in zip(LETTERS[word], bars):
            if used == "1":
                self.box((x + low[0] * size, y, z + low[1] * size), (x + high[0] * size, y + depth * self.between(0.9, 1.1), z + high[1] * size))
        return x + 0.7 * size + t


def car(m):
    length, width, height = m.between(3.5, 5), m.between(1.5, 1.9), m.between(0.5, 0.7)
    floor, wheel = 0.35, m.between(0.3, 0.4)
    m.box((0, 0, floor), (length, width, floor + height))
    a, b = m.between(0.2, 0.35) * length, m.between(0.7, 0.95) * length
    m.box((a, 0.06, floor + height - 0.02), (b, width - 0.06, floor + height + m.between(0.4, 0.6)), shear=m.between(-0.1, 0.2), without=(4,))
    for x in (0.2 * length, 0.8 * length):
        for y in (-0.05, width - 0.2):
            m.tube((x, y, wheel), 1, wheel, 0.25)
            m.tube((x, y - 0.01, wheel), 1, 0.5 * wheel, 0.27)
        m.tube((x, 0, wheel), 1, 0.05, width)  # an axle, inside for the most part
    for y in (0.3, width - 0.7):  # seats, inside
        m.box((a + 0.2, y, floor + 0.1), (a + 0.7, y + 0.4, floor + height + 0.2))
    m.sheet(((a + 0.02, 0.1, floor + height), (a + 0.02, width - 0.1, floor + height), (a + 0.2, width - 0.1, floor + height + 0.4), (a + 0.2, 0.1, floor + height + 0.4)))
    if m.chance(0.5):
        m.sheet(((length - 0.1, 0, floor + height + 0.3), (length + 0.1, 0, floor + height + 0.3), (length + 0.1, width, floor + height + 0.3), (length - 0.1, width, floor + height + 0.3)), 3)
    for y in (-0.15, width):  # mirrors, that only touch
        m.box((a + 0.1, y, floor + height), (a + 0.2, y + 0.15, floor + height + 0.12))


def chair(m):
    width, depth, seat, back = m.between(0.4, 0.6), m.between(0.4, 0.6), m.between(0.4, 0.5), m.between(0.8, 1.1)
    leg, flat = m.between(0.015, 0.03), m.chance(0.4)
    if flat:
        m.sheet(((0, 0, seat), (width, 0, seat), (width, depth, seat), (0, depth, seat)), 1 + int(3 * m.random()))
    else:
        m.box((0, 0, seat - 0.02), (width, depth, seat + 0.02))
    for x in (leg, width - leg):
        for y in (leg, depth - leg):
            top = back if y > depth / 2 else seat
            if m.chance(0.5):
                m.tube((x, y, 0), 2, leg, top, end=0.8 * leg, capped=m.chance(0.7))
            else:
                m.box((x - leg, y - leg, 0), (x + leg, y + leg, top))
    for i in range(2 + int(4 * m.random())):  # slats, with gaps between them
        z = seat + 0.1 + i * 0.09
        if z < back - 0.05:
            m.box((0, depth - 1.5 * leg, z), (width, depth - 0.5 * leg, z + 0.06))
    if m.chance(0.5):
        m.sheet(((0, 0, seat + 0.2), (0, depth, seat + 0.2), (0.05, depth, seat + 0.2), (0.05, 0, seat + 0.2)))


def lamp(m):
    height, foot = m.between(0.8, 1.6), m.between(0.12, 0.2)
    m.tube((0, 0, 0), 2, foot, 0.03, end=0.9 * foot)
    m.tube((0, 0, 0), 2, m.between(0.01, 0.02), height, capped=False)
    shade = m.between(0.15, 0.3)
    m.tube((0, 0, height - 0.3), 2, shade, m.between(0.2, 0.35), end=m.between(0.4, 0.9) * shade, capped=False)  # a sheet with two sides
    m.tube((0, 0, height - 0.2), 2, 0.04, 0.1, end=0.05)  # the bulb, inside
    for i in range(3):
        c, s = CIRCLE[5 * i]
        m.sheet(((0, 0, height - 0.1), (shade * c, shade * s, height - 0.1), (shade * c, shade * s, height - 0.09), (0, 0, height - 0.09)))


def plane(m):
    length, radius, span = m.between(8, 12), m.between(0.5, 0.7), m.between(4, 6)
    m.tube((0, 0, 0), 0, radius, length, capped=m.chance(0.6))
    m.tube((length, 0, 0), 0, radius, 0.15 * length, end=0.05)
    m.tube((0, 0, 0), 0, 0.9 * radius, -0.1 * length, end=0.2)
    thick = m.between(0, 0.12)
    for side in (-1, 1):
        x, tip = 0.45 * length, (0.35 * length, side * span)
        low = [(x, 0, -0.1), (x + 1.5, 0, -0.1), (tip[0] + 1, tip[1], 0.1), (tip[0], tip[1], 0.1)]
        if thick < 0.03:
            m.sheet(low)
        else:
            m.add(low + [(p[0], p[1], p[2] + thick) for p in low], [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
        m.sheet(((0.1, 0, 0.2), (0.9, 0, 0.2), (0.6, side * 1.6, 0.3), (0.2, side * 1.6, 0.3)), 2)
        m.tube((x - 0.2, side * 0.45 * span, -0.4), 0, 0.3, 1.2, end=0.25, capped=m.chance(0.5))
    m.sheet(((0, 0, radius), (1, 0, radius), (0.5, 0, radius + 1.4), (0.1, 0, radius + 1.4)))
    for i in range(6):  # seats, inside
        m.box((2 + i, -0.2, -0.2), (2.4 + i, 0.2, 0.2))


def sign(m):
    x, size, words = 0.0, 1.0, sorted(LETTERS)
    for _ in range(3 + int(4 * m.random())):
        x = m.letter(words[int(len(words) * m.random())], x, 0, 0, size, m.between(0.15, 0.3))
    m.box((-0.1, 0.1, -0.25), (x, 0.18, 0.02))
    m.box((-0.1, 0.1, 0.98), (x, 0.18, 1.1), without=(0, 1))


def dirt(m):
    """Faces twice, some of them turned, and fragments in the air and inside."""
    for f in list(m.faces):
        if m.chance(0.05):
            m.faces.append(tuple(reversed(f)) if m.chance(0.5) else f)
    lows, highs = [min(axis) for axis in zip(*m.positions)], [max(axis) for axis in zip(*m.positions)]
    side = max(h - l for l, h in zip(lows, highs))
    for _ in range(int(6 * m.random())):
        p = [m.between(l, h) for l, h in zip(lows, highs)]
        m.box(p, [x + 0.002 * side for x in p])


def model(number):
    m = Maker(number)
    globals()[KINDS[number % len(KINDS)]](m)
    dirt(m)
    return m


def write(number, path):
    m = model(number)
    with open(path, "w", encoding="ascii") as file:
        file.write(f"# {KINDS[number % len(KINDS)]} {number}\n")
        file.writelines("v {:.6f} {:.6f} {:.6f}\n".format(*p) for p in m.positions)
        file.writelines("f " + " ".join(str(i + 1) for i in f) + "\n" for f in m.faces)


if __name__ == "__main__":
    if len(sys.argv) != 3 or not sys.argv[1].isdigit() or int(sys.argv[1]) >= COUNT:
        sys.exit(__doc__)
    write(int(sys.argv[1]), sys.argv[2])
