#!/usr/bin/python3
"""Solves the problem of compare_peers by scipy.optimize.least_squares: model and analytic
derivatives in numpy, all touches at once. Prints times and solution as JSON.

usage: compare_scipy.py FOLDER RUNS
"""

import json
import sys
import time

import numpy
from scipy.optimize import least_squares

THETA, D, A, ALPHA, BETA = range(5)  # kinds of a joint's errors


class Model:
    def __init__(self, folder):
        with open(folder + "/problem.json", encoding="ascii") as file:
            self.p = json.load(file)
        touches = numpy.loadtxt(folder + "/touches.txt")
        self.q, self.target = touches[:, :6], touches[:, 6].astype(int)
        self.base, self.flange = numpy.array(self.p["base"]), numpy.array(self.p["flange"])
        self.g, self.tcp = numpy.array(self.p["gravity"]), numpy.array(self.p["tcp"])
        targets = numpy.array(self.p["targets"])
        self.radius = targets[self.target, 4]
        self.kinds = self.p["parameters"]
        self.scale = numpy.array([sigma for _, _, sigma in self.kinds] + [self.p["rho_sigma"]]
                                 + list(numpy.repeat(targets[:, 3], 3)))
        self.origin = numpy.concatenate([numpy.zeros(len(self.kinds) + 1), targets[:, :3].ravel()])
        self.size = len(self.scale)

    def rows(self, u):
        """Whitened residuals and derivatives by u: touches, then priors."""
        x, n, arm = self.origin + self.scale * u, len(self.q), len(self.kinds)
        error, bending = numpy.zeros((6, 5)), 0.0
        for (kind, joint, _), value in zip(self.kinds, x):
            if joint < 0:
                bending = value
            else:
                error[joint, kind] = value
        turn = numpy.broadcast_to(self.base[:3, :3], (n, 3, 3)).copy()
        at = numpy.broadcast_to(self.base[:3, 3], (n, 3)).copy()
        axes = []  # per joint: z and its origin, x, y, end
        for i, (sign, offset, d, a, alpha, beta) in enumerate(self.p["joints"]):
            z, start = turn[:, :, 2].copy(), at
            mix(turn, 0, 1, sign * self.q[:, i] + offset + error[i, THETA])
            along = turn[:, :, 0].copy()
            at = at + (d + error[i, D]) * z + (a + error[i, A]) * along
            mix(turn, 1, 2, alpha + error[i, ALPHA])
            y = turn[:, :, 1].copy()
            mix(turn, 2, 0, beta + error[i, BETA])
            axes.append((z, start, along, y, at))
        at = at + turn @ self.flange[:3, 3]
        turn = turn @ self.flange[:3, :3]
        rigid, z = at + turn @ self.tcp, turn[:, :, 2]
        gz, bend = z @ self.g, bending * self.p["stiff"]
        across = self.g - gz[:, None] * z
        centre = x[arm + 1:].reshape(-1, 3)[self.target]
        off = rigid + bend * across - centre
        distance = numpy.sqrt(numpy.einsum("ij,ij->i", off, off))
        normal = off / distance[:, None]

        def turned(axis, point):
            dz = numpy.cross(axis, z)
            return (numpy.cross(axis, rigid - point)
                    - bend * ((dz @ self.g)[:, None] * z + gz[:, None] * dz))

        weight = 1.0 / self.p["touch_sigma"]
        j = numpy.zeros((n + self.size, self.size))
        for c, (kind, joint, _) in enumerate(self.kinds):
            if joint < 0:
                move = self.p["stiff"] * across
            else:
                z_joint, start, along, y, end = axes[joint]
                move = (turned(z_joint, start) if kind == THETA else z_joint if kind == D
                        else along if kind == A else turned(along, end) if kind == ALPHA
                        else turned(y, end))
            j[:n, c] = numpy.einsum("ij,ij->i", normal, move)
        j[:n, arm] = -1.0
        for k in range(3):
            j[numpy.arange(n), arm + 1 + 3 * self.target + k] = -normal[:, k]
        j[:n] *= weight * self.scale
        j[n:] = numpy.eye(self.size)
        r = numpy.concatenate([weight * (distance - self.radius - x[arm]), u])
        return r, j


def mix(turn, a, b, angle):
    """Rotates columns a and b of each rotation matrix."""
    c, s = numpy.cos(angle), numpy.sin(angle)
    if numpy.ndim(angle):
        c, s = c[:, None], s[:, None]
    first = turn[:, :, a].copy()
    turn[:, :, a] = c * first + s * turn[:, :, b]
    turn[:, :, b] = c * turn[:, :, b] - s * first


def solve(model):
    last = {}

    def at(u):  # residuals and derivatives are requested in succession
        if "u" not in last or not numpy.array_equal(last["u"], u):
            last["u"], last["rows"] = u.copy(), model.rows(u)
        return last["rows"]

    return least_squares(lambda u: at(u)[0], numpy.zeros(model.size), jac=lambda u: at(u)[1],
                         method="lm", ftol=1e-12, xtol=1e-12, gtol=1e-12)


def main():
    model = Model(sys.argv[1])
    seconds = []
    for _ in range(int(sys.argv[2])):
        start = time.perf_counter()
        result = solve(model)
        seconds.append(time.perf_counter() - start)
    x = model.origin + model.scale * result.x
    print(json.dumps({"seconds": seconds, "x": list(x), "iterations": int(result.njev or 0)}))


if __name__ == "__main__":
    main()
