#!/usr/bin/env python3
"""The bracket of crates/solve/tests/it/tetra by an independent finite-element program: scikit-fem, quadratic tetrahedra.

    python3 -m venv venv && venv/bin/pip install scikit-fem gmsh==4.15.2
    venv/bin/python scripts/bracket-reference.py crates/solve/tests/it/tetra/meshes/bracket_coarse.msh

-div k grad T = 0; k = 50 W/(m K). Foot: film 400 W/(m2 K) to 20 degC. Pad: 20 kW/m2 into the metal. Back, bore and
the rest: radiation, emissivity 0.8, to 20 degC. The domain is the one of the coarse mesh (its bore is a polygon);
each level halves every edge. Prints mean temperatures (degC) and the heat through the foot (W).
"""
import sys
import gmsh
import numpy as np
from scipy.sparse.linalg import LinearOperator, cg
import skfem
from skfem.helpers import dot, grad

K, H, FLUX, EPS, T0 = 50.0, 400.0, 2e4, 0.8, 293.15
SIGMA = 5.670374419e-8


def read(path):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = {t: i for i, t in enumerate(tags)}
    _, _, nodes = gmsh.model.mesh.getElements(3)
    tets = np.array([place[n] for n in nodes[0]]).reshape(-1, 4)
    gmsh.finalize()
    points = np.array(xyz).reshape(-1, 3) * 1e-3
    return skfem.MeshTet(points.T.copy(), tets.T.copy())


def named(mesh):
    """The mesh with its boundary cut into faces by their place."""
    facets = mesh.boundary_facets()
    x, y, z = mesh.p[:, mesh.facets[:, facets]]
    on = lambda a, b: (abs(a - b) < 1e-9).all(axis=0)
    foot, back, pad = on(z, 0), on(x, 0), on(z, 0.01)
    bore = (np.hypot(y - 0.02, z - 0.045) < 0.0101).all(axis=0) & ~back & ~on(x, 0.01)
    rest = ~(foot | back | pad | bore)
    return mesh.with_boundaries({n: facets[k] for n, k in {"foot": foot, "back": back, "pad": pad, "bore": bore, "rest": rest}.items()})


def solve(mesh, element):
    basis = skfem.Basis(mesh, element)
    foot, pad = (basis.boundary(n) for n in ("foot", "pad"))
    radiating = [basis.boundary(n) for n in ("back", "bore", "rest")]
    conduction = skfem.BilinearForm(lambda u, v, w: K * dot(grad(u), grad(v))).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, w: u * v)
    one = skfem.LinearForm(lambda v, w: 1.0 * v)
    fixed = conduction + H * mass.assemble(foot)
    load = H * T0 * one.assemble(foot) + FLUX * one.assemble(pad)
    t = np.full(basis.N, T0)
    tangent = skfem.BilinearForm(lambda u, v, w: 4 * EPS * SIGMA * w["t"] ** 3 * u * v)
    loss = skfem.LinearForm(lambda v, w: EPS * SIGMA * (w["t"] ** 4 - T0**4) * v)
    for _ in range(20):
        jacobian, residual = fixed, fixed @ t - load
        for b in radiating:
            jacobian = jacobian + tangent.assemble(b, t=b.interpolate(t))
            residual = residual + loss.assemble(b, t=b.interpolate(t))
        d = 1 / jacobian.diagonal()
        step, info = cg(jacobian, -residual, rtol=1e-11, M=LinearOperator(jacobian.shape, lambda x: d * x), maxiter=20000)
        assert info == 0
        t += step
        if abs(step).max() < 1e-9:
            break
    value = skfem.Functional(lambda w: w["t"])
    area = skfem.Functional(lambda w: 1.0 + 0 * w.x[0])
    mean = lambda b: value.assemble(b, t=b.interpolate(t)) / area.assemble(b) - 273.15
    heat = skfem.Functional(lambda w: H * (w["t"] - T0)).assemble(foot, t=foot.interpolate(t))
    bore, back = basis.boundary("bore"), basis.boundary("back")
    return basis.N, mean(basis), mean(bore), mean(pad), mean(back), heat


if __name__ == "__main__":
    mesh = read(sys.argv[1])
    print("level order unknowns  volume bore pad back / degC  foot / W")
    for level in range(3):
        for element in (skfem.ElementTetP1(), skfem.ElementTetP2()):
            order = 1 if isinstance(element, skfem.ElementTetP1) else 2
            print(level, order, *("%.7g" % x for x in solve(named(mesh), element)), flush=True)
        mesh = mesh.refined()
