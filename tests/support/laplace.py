"""Capacitance of a gap by Laplace's equation, on tetrahedra with linear potential."""

from itertools import permutations

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve


def capacitance(gap, spacing, layers):
    """Return the capacitance over ε₀ [m] between the plane z = 0 and z = gap, and that of plates.

    `gap` [m] is given at nodes, shape (nx, ny). No flux leaves through the sides.
    """
    nx, ny = gap.shape
    share = np.linspace(0.0, 1.0, layers + 1)
    nodes = np.stack(
        np.broadcast_arrays(
            (np.arange(nx) * spacing[0])[:, None, None],
            (np.arange(ny) * spacing[1])[:, None],
            gap[:, :, None] * share,
        ),
        axis=-1,
    ).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape(nx, ny, layers + 1)
    corner = number[:-1, :-1, :-1].ravel()
    steps = np.array([(layers + 1) * ny, layers + 1, 1])
    tetrahedra = []
    for order in permutations(range(3)):  # six fill a hexahedron
        ends = [corner]
        for axis in order:
            ends.append(ends[-1] + steps[axis])
        tetrahedra.append(np.stack(ends, axis=1))
    cells = np.concatenate(tetrahedra)
    edges = nodes[cells[:, 1:]] - nodes[cells[:, :1]]
    volume = np.abs(np.linalg.det(edges)) / 6.0
    inverse = np.linalg.inv(edges)
    slopes = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
    local = volume[:, None, None] * np.einsum("cdi,cdj->cij", slopes, slopes)
    rows, columns = np.repeat(cells, 4, axis=1).ravel(), np.tile(cells, (1, 4)).ravel()
    stiffness = sparse.csr_matrix((local.ravel(), (rows, columns)), shape=[len(nodes)] * 2)
    potential = np.zeros(len(nodes))
    potential[number[:, :, -1].ravel()] = 1.0
    inner = number[:, :, 1:-1].ravel()
    load = -(stiffness @ potential)[inner]
    potential[inner] = spsolve(stiffness[inner][:, inner].tocsc(), load)
    weights = np.ones(gap.shape)
    for edge in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
        weights[edge] /= 2.0
    plates = float((weights / gap).sum()) * spacing[0] * spacing[1]
    return float(potential @ (stiffness @ potential)), plates
