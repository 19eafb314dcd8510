"""Friction against others that compute the same: cvxpy, scipy, the paper's stored and recorded data."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from tests.extras import extra

from flatpush.friction import Exact, Support, fit_ellipsoid, fit_quartic
from flatpush.friction.report import twist_angles
from flatpush.friction.sos import minors, tensors

OLD = {"regularisation": 0.1, "force_weight": 2.0, "velocity_weight": 1.0}  # the paper's toolbox


def sampled(
    points: np.ndarray, length: float, count: int, facets: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Wrench-twist pairs as the paper's toolbox draws them, normalised by the length."""
    radius = float(np.mean(np.hypot(*(points - points.mean(axis=0)).T)))
    sphere = rng.normal(size=(int(np.ceil((1 - facets) * count / 2)), 3))
    free = np.stack([-sphere[:, 1], sphere[:, 0]], axis=1) / sphere[:, 2:] * radius + points.mean(axis=0)
    copies = int(np.ceil(facets * count / 2 / len(points)))
    centres = np.concatenate([free, np.tile(points, (copies, 1))])
    wrenches, twists = [], []
    for c in centres:
        for sense in (1.0, -1.0):
            r = points - c
            size = np.hypot(*r.T)
            u = sense * np.stack([-r[:, 1], r[:, 0]], axis=1) / np.where(size > 0, size, 1.0)[:, None]
            angle, magnitude = rng.uniform(0, 2 * np.pi), rng.uniform()
            u[size == 0] = magnitude * np.array([np.cos(angle), np.sin(angle)])
            wrenches.append(
                [*u.mean(axis=0), np.mean(points[:, 0] * u[:, 1] - points[:, 1] * u[:, 0]) / length]
            )
            twists.append(sense * np.array([c[1], -c[0], length]))
    return np.array(wrenches), np.array(twists)


@pytest.mark.parametrize(
    ("case", "points", "stored"),
    [
        ("rect_boundary", "support_points_rect_boundary.csv", "plan_graph_bigrect_mu03nd12_cs03.json"),
        ("triangle_boundary", "support_points_triangle_boundary.csv", "plan_graph_triangle_mu03nd15.json"),
        (
            "butterfly",
            "support_points_butterfly_boundary.csv",
            "plan_graph_butter_mu025nd10_cs05_vbhalfmm.json",
        ),
    ],
)
def test_the_stored_ellipsoids_are_reproduced(data_folder: Path, case: str, points: str, stored: str) -> None:
    references = json.loads((data_folder / "plan_graph" / "ls_fit_reference.json").read_text())
    reference = next(r for r in references if r["case"].startswith(case.split("_")[0]))
    places = np.loadtxt(data_folder / "plan_graph" / points, delimiter=",", skiprows=1)[:, -2:]
    rng = np.random.default_rng(0)
    fits = []
    for _ in range(3):
        W, V = sampled(places, reference["pho"], reference["num_cors"], reference["r_facet"], rng)
        fits.append(fit_ellipsoid(W, V, length=1.0, force=1.0, **OLD).matrix)
    spread = np.maximum(np.array(reference["A_std"]), 0.003)
    # The mean of three against the mean of many draws: two and a half standard errors.
    assert np.all(np.abs(np.mean(fits, axis=0) - reference["A_mean"]) <= 2.5 * spread)
    # The toolbox's own matrix is one draw, with its own random numbers.
    kept = np.array(json.loads((data_folder / "plan_graph" / stored).read_text())["object"]["ls_fit_full"])
    np.testing.assert_allclose(np.diag(np.mean(fits, axis=0)), np.diag(kept), rtol=0.04)


def recorded(data_folder: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    out = {}
    for path in sorted((data_folder / "icra_sensor").glob("pushes_*_*.csv")):
        with path.open() as file:
            rows = list(csv.DictReader(file))
        W = np.array([[float(r[k]) for k in ("Fx", "Fy", "tau")] for r in rows])
        V = np.array([[float(r[k]) for k in ("dx_body", "dy_body", "dtheta")] for r in rows])
        out[path.stem.removeprefix("pushes_")] = W, V
    return out


def test_recorded_pushes_prefer_the_quartic(data_folder: Path) -> None:
    """Five folds of 50 pushes in each of seven experiments, mean angle of the twists left out [deg]."""
    angles: dict[str, list[np.ndarray]] = {"ellipsoid": [], "quartic": []}
    for W, V in recorded(data_folder).values():
        folds = np.random.default_rng(0).permutation(len(W)) % 5
        for name, fit in (("ellipsoid", fit_ellipsoid), ("quartic", fit_quartic)):
            of_this = np.concatenate(
                [
                    twist_angles(
                        fit(W[folds != k], V[folds != k]).twist(W[folds == k]), V[folds == k], 0.05 * 2**0.5
                    )
                    for k in range(5)
                ]
            )
            angles[name].append(np.degrees(of_this))
    means = {name: np.array([np.mean(a) for a in those]) for name, those in angles.items()}
    assert np.all(means["quartic"] < means["ellipsoid"])
    # The best reported elsewhere on these data: 14.1° and 11.1° (medians 11.5° and 7.8°).
    assert means["ellipsoid"].mean() < 14.3
    assert means["quartic"].mean() < 11.1
    assert np.median(np.concatenate(angles["quartic"])) < 7.8


def test_cvxpy_finds_no_better_fit() -> None:
    cp = pytest.importorskip("cvxpy", reason=extra("test-all"))
    rng = np.random.default_rng(4)
    support = Support.points(rng.uniform(-1, 1, (4, 2)), rng.uniform(0.2, 1, 4)).centred()
    V = rng.normal(size=(25, 3))
    W = support.wrench(V) + 0.05 * rng.normal(size=V.shape)
    unit = V / np.linalg.norm(V, axis=1, keepdims=True)
    options = {
        "length": 1.0,
        "force": 1.0,
        "regularisation": 0.02,
        "force_weight": 0.7,
        "velocity_weight": 1.3,
    }

    def cost(values: object, gradients: object, norm: object, scale: object, library: object) -> object:
        misses = [library.norm(gradients[i] - scale[i] * unit[i]) for i in range(len(W))]  # type: ignore
        return 0.02 * norm + (0.7 * library.sum(library.abs(values - 1)) + 1.3 * sum(misses)) / len(W)  # type: ignore

    class Plain:
        sum, abs, norm = staticmethod(np.sum), staticmethod(np.abs), staticmethod(np.linalg.norm)

    def scales(gradients: np.ndarray) -> np.ndarray:
        return np.maximum(np.sum(gradients * unit, axis=1), 1e-3)

    A, s = cp.Variable((3, 3), PSD=True), cp.Variable(len(W))
    values = cp.sum(cp.multiply(W @ A, W), axis=1)
    problem = cp.Problem(cp.Minimize(cost(values, W @ A, cp.norm(A, "fro"), s, cp)), [s >= 1e-3])
    problem.solve(solver=cp.CLARABEL)
    ours = fit_ellipsoid(W, V, **options)
    ours_cost = cost(ours.value(W), ours.twist(W), np.linalg.norm(ours.matrix), scales(ours.twist(W)), Plain)
    assert ours_cost == pytest.approx(problem.value, rel=1e-5)
    np.testing.assert_allclose(ours.matrix, A.value, atol=1e-3)

    v, Q, s = cp.Variable(15), cp.Variable((9, 9), PSD=True), cp.Variable(len(W))
    z = cp.Variable(9)
    gram = sum(12 * v[k] * tensors()[k].reshape(9, 9) for k in range(15)) + sum(
        z[k] * minors()[k] for k in range(9)
    )
    gradient = 4 * np.einsum("Kijkl,nj,nk,nl->niK", tensors(), W, W, W)
    value = np.einsum("niK,ni->nK", gradient, W) / 4
    gradients = cp.vstack([gradient[i] @ v for i in range(len(W))])
    problem = cp.Problem(cp.Minimize(cost(value @ v, gradients, cp.norm(v), s, cp)), [s >= 1e-3, gram == Q])
    problem.solve(solver=cp.CLARABEL)
    quartic = fit_quartic(W, V, **options)
    twists = quartic.twist(W)
    ours_cost = cost(quartic.value(W), twists, np.linalg.norm(quartic.coefficients), scales(twists), Plain)
    assert ours_cost == pytest.approx(problem.value, rel=1e-5)


def test_scipy_finds_no_twist_of_less_dissipation() -> None:
    from scipy.optimize import minimize

    rng = np.random.default_rng(2)
    for support in (
        Support.points(rng.normal(size=(5, 2)), rng.uniform(0.1, 1, 5)),
        Support.polygon([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)]),
        Support.ring(1.5),
    ):
        surface = Exact(support.centred())
        for F in rng.normal(size=(4, 3)):
            V = surface.twist(F)
            least = float(surface.support.dissipation(V)) / float(F @ V)
            basis = np.linalg.svd(F[None])[2][1:]

            def dissipation(
                y: np.ndarray, F: np.ndarray = F, Z: np.ndarray = basis, of: Exact = surface
            ) -> float:
                return float(of.support.dissipation(F / (F @ F) + y @ Z))

            options = {"xatol": 1e-9, "fatol": 1e-12, "maxiter": 400}
            found = min(
                float(minimize(dissipation, start, method="Nelder-Mead", options=options).fun)
                for start in rng.normal(size=(2, 2))
            )
            assert least <= found + 1e-12
            assert least == pytest.approx(found, rel=1e-7)
