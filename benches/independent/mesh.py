"""A finite-volume mesh of boxes: conduction, joints of faces that need not match, open areas, points, channels."""

import itertools
import math

import numpy as np
import scipy.sparse as sparse

from describe import AXES, CONDUCTIVITY


def overlaps(a, b):
    """Lengths that the cells between the edges a share with those between the edges b."""
    low = np.maximum(a[:-1, None], b[None, :-1])
    high = np.minimum(a[1:, None], b[None, 1:])
    return np.maximum(high - low, 0.0)


class Block:
    """The cells of one part."""

    def __init__(self, part, offset):
        self.part, self.offset, self.n = part, offset, part.cells
        self.step = [size / n for size, n in zip(part.size, part.cells)]
        self.k = CONDUCTIVITY[part.material]
        self.ids = offset + np.arange(math.prod(part.cells)).reshape(part.cells)
        self.edges = [part.at[i] + np.linspace(0, part.size[i], part.cells[i] + 1) for i in range(3)]
        self.open = np.zeros(self.ids.size)

    def face(self, side):
        """Cells, the two axes along the face, and half a cell's depth."""
        axis = AXES.index(side[1])
        cells = np.take(self.ids, -1 if side[0] == "+" else 0, axis=axis)
        return cells, [i for i in range(3) if i != axis], self.step[axis] / 2

    def conduction(self, size):
        """The part's own conduction, W/K, at the library's conductivity."""
        total = None
        for axis in range(3):
            n = self.n[axis]
            line = sparse.diags([np.r_[1.0, 2 * np.ones(n - 2), 1.0] if n > 1 else [0.0], -np.ones(n - 1), -np.ones(n - 1)],
                                [0, 1, -1])
            terms = [sparse.identity(m) for m in self.n]
            terms[axis] = line * (self.k * math.prod(self.step) / self.step[axis] ** 2)
            term = sparse.kron(sparse.kron(terms[0], terms[1]), terms[2])
            total = term if total is None else total + term
        total = total.tocoo()
        return sparse.csr_matrix((total.data, (total.row + self.offset, total.col + self.offset)), shape=(size, size))

    def point(self, point):
        """Cells and weights of a temperature: parabolas through three cells along every axis, continued to the surface."""
        axes = []
        for i in range(3):
            place = point[i] / self.step[i] - 0.5
            first = min(max(round(place) - 1, 0), self.n[i] - 3)
            x = place - first
            axes.append([(first, (x - 1) * (x - 2) / 2), (first + 1, x * (2 - x)), (first + 2, x * (x - 1) / 2)])
        corners = list(itertools.product(*axes))
        return (np.array([self.ids[tuple(c[0] for c in corner)] for corner in corners]),
                np.array([math.prod(c[1] for c in corner) for corner in corners]))


class Run:
    """A channel in stations of equal length: the cell of each, and the resistance (m K/W) between cell and wall."""

    def __init__(self, channel, block):
        self.diameter = channel.diameter
        corners = np.array(channel.path)
        legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        self.length = legs.sum()
        count = math.ceil(self.length / (0.5 * min(block.step)))
        self.step = self.length / count
        middle = (np.arange(count) + 0.5) * self.step
        ends = np.r_[0.0, np.cumsum(legs)]
        leg = np.clip(np.searchsorted(ends, middle) - 1, 0, len(legs) - 1)
        where = corners[leg] + (corners[leg + 1] - corners[leg]) * ((middle - ends[leg]) / legs[leg])[:, None]
        index = np.floor(where / np.array(block.step)).astype(int)
        self.cells = block.ids[tuple(index.T)]
        along = np.argmax(np.abs(corners[leg + 1] - corners[leg]), axis=1)
        squares = np.array(block.step) ** 2
        radius = 0.14 * np.sqrt(squares.sum() - squares[along])  # Peaceman 1983: where the cell's temperature is met
        self.spread = float(np.mean(np.log(radius / (channel.diameter / 2)))) / (2 * math.pi * block.k)


class Mesh:
    def __init__(self, machine):
        self.blocks, offset = {}, 0
        for name, part in machine.parts.items():
            self.blocks[name] = Block(part, offset)
            offset += math.prod(part.cells)
        self.size = offset
        self.conduction = {name: b.conduction(offset) for name, b in self.blocks.items()}
        for block in self.blocks.values():
            for side in (s + a for s in "+-" for a in AXES):
                cells, along, _ = block.face(side)
                block.open[cells.ravel() - block.offset] += math.prod(block.step[i] for i in along)
        self.joints = {name: self.joint(c) for name, c in machine.contacts.items()}
        self.runs = {name: Run(c, self.blocks[c.part]) for name, c in machine.channels.items()}

    def joint(self, contact):
        """Pairs of cells as a Laplacian of shared areas, and the half cells of both sides; covers what it touches."""
        (a, side_a), (b, side_b) = contact.a.split("."), contact.b.split(".")
        a, b = self.blocks[a], self.blocks[b]
        cells_a, along, half_a = a.face(side_a)
        cells_b, _, half_b = b.face(side_b)
        first, second = (overlaps(a.edges[i], b.edges[i]) for i in along)
        shared = np.einsum("ik,jl->ijkl", first, second)
        i, j, k, l = np.nonzero(shared > 1e-12)
        area, left, right = shared[i, j, k, l], cells_a[i, j], cells_b[k, l]
        np.subtract.at(a.open, left - a.offset, area)
        np.subtract.at(b.open, right - b.offset, area)
        rows, columns = np.r_[left, right, left, right], np.r_[left, right, right, left]
        pattern = sparse.csr_matrix((np.r_[area, area, -area, -area], (rows, columns)), shape=(self.size, self.size))
        weight = np.bincount(left, area, self.size) / area.sum() - np.bincount(right, area, self.size) / area.sum()
        return {"pattern": pattern, "a": contact.a.split(".")[0], "b": contact.b.split(".")[0],
                "half_a": half_a / a.k, "half_b": half_b / b.k, "drop": weight, "area": area.sum()}

    def surface(self, name):
        """The open area of every cell of a part."""
        out = np.zeros(self.size)
        block = self.blocks[name]
        out[block.ids.ravel()] = np.maximum(block.open, 0.0)
        return out

    def volume(self, name):
        """Weights of a part's mean temperature; also how its heat is shared."""
        out = np.zeros(self.size)
        ids = self.blocks[name].ids.ravel()
        out[ids] = 1 / ids.size
        return out

    def spot(self, name, point, radius=0.02):
        """Weights of the open cells about a point of a part's surface."""
        block = self.blocks[name]
        centres = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) * s for n, s in zip(block.n, block.step)], indexing="ij"), -1)
        near = np.linalg.norm(centres.reshape(-1, 3) - np.array(point), axis=1)
        weight = np.where(near <= max(radius, near[block.open > 0].min() * 1.01), np.maximum(block.open, 0.0), 0.0)
        out = np.zeros(self.size)
        out[block.ids.ravel()] = weight / weight.sum()
        return out
