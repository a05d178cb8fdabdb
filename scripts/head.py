"""A human head as a star-shaped mesh: the object of the paper's Figure 2, of our own making.

The radius in the direction n is that of an ellipsoid that narrows towards the jaw, plus bumps h/(1 + d^2)^2 with d the
distance of n from the middle of the bump in units of its three widths: brow, eye sockets, nose, cheeks, lips, chin, ears,
back of the skull. The face looks along +Z, +Y is up, the size is a head's in metres. Only + - * / and sqrt.
"""

import math

# Half width, half height, half depth [m].
SKULL = (0.076, 0.114, 0.094)
# Middle on the sphere, widths, height [m]; (x, ...) stands for -x too.
BUMPS = [
    ((0.0, -0.10, 0.99), (0.16, 0.20, 0.30), 0.026),  # tip of the nose
    ((0.0, 0.14, 0.99), (0.10, 0.20, 0.30), 0.008),  # its bridge
    ((0.34, 0.30, 0.89), (0.26, 0.10, 0.30), 0.007),  # brow
    ((0.36, 0.12, 0.92), (0.18, 0.12, 0.30), -0.010),  # eye socket
    ((0.52, -0.18, 0.84), (0.25, 0.22, 0.30), 0.005),  # cheek
    ((0.0, -0.43, 0.90), (0.24, 0.09, 0.30), 0.008),  # upper lip
    ((0.0, -0.51, 0.86), (0.24, 0.05, 0.30), -0.007),  # mouth
    ((0.0, -0.59, 0.81), (0.20, 0.09, 0.30), 0.008),  # lower lip
    ((0.0, -0.82, 0.57), (0.26, 0.18, 0.30), 0.016),  # chin
    ((0.98, 0.02, -0.05), (0.30, 0.22, 0.10), 0.020),  # ear
    ((0.90, 0.02, 0.25), (0.30, 0.25, 0.12), -0.004),  # in front of the ear
    ((0.0, 0.30, -0.95), (0.60, 0.50, 0.60), 0.012),  # back of the skull
]  # fmt: skip


def radius(n):
    """Radius [m] in the direction of the unit vector n."""
    x, y, z = n
    narrowing = 1.0 + 0.22 * min(y, 0.0) * (1.0 if z > 0.0 else 1.0 + z)
    a, b, c = SKULL
    p, q, s = x / (a * narrowing), y / b, z / c
    r = 1.0 / math.sqrt(p * p + q * q + s * s)
    for middle, widths, height in BUMPS:
        for side in (1.0, -1.0) if middle[0] else (1.0,):
            e, f, g = ((m - w) / u for m, w, u in zip(n, (side * middle[0], *middle[1:]), widths, strict=True))
            d = 1.0 + e * e + f * f + g * g
            r += height / (d * d)
    return r


def mesh(cells):
    """Triangles of the head over a cube with `cells` cells along each edge: 12 cells^2 of them, fronts outward."""
    points = {}

    def point(i, j, k):
        if (i, j, k) not in points:
            x, y, z = (2.0 * a / cells - 1.0 for a in (i, j, k))
            # The cube rounded to a sphere with cells of nearly equal size.
            n = (
                x * math.sqrt(1.0 - y * y / 2.0 - z * z / 2.0 + y * y * z * z / 3.0),
                y * math.sqrt(1.0 - z * z / 2.0 - x * x / 2.0 + z * z * x * x / 3.0),
                z * math.sqrt(1.0 - x * x / 2.0 - y * y / 2.0 + x * x * y * y / 3.0),
            )
            r = radius(n)
            points[i, j, k] = tuple(r * a for a in n)
        return points[i, j, k]

    faces = []
    for axis in range(3):
        for end in (0, cells):
            for u in range(cells):
                for v in range(cells):

                    def corner(du, dv, axis=axis, end=end, u=u, v=v):
                        at = [0, 0, 0]
                        at[axis], at[axis - 2], at[axis - 1] = end, u + du, v + dv
                        return point(*at)

                    square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
                    faces.append(tuple(square if end else [square[0], *reversed(square[1:])]))
    return faces
