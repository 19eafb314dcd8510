"""Homogeneous quartics in three variables and the Gram matrices of their Hessians.

A quartic H is SOS-convex if y'∇²H(x)y = m'Qm with m = (y₁x₁, y₁x₂, y₁x₃, y₂x₁, …, y₃x₃) and Q ⪰ 0 (9 × 9).
With the symmetric tensor T of H = T(x, x, x, x), Q = 12 T is one such matrix; all others differ by the nine
minors (yᵢxⱼ)(yₖxₗ) - (yᵢxₗ)(yₖxⱼ), which vanish identically. So 15 coefficients and 9 numbers stand for all
Gram matrices.
"""

from functools import cache
from itertools import combinations, permutations, product
from typing import TYPE_CHECKING

import numpy as np

from ..errors import FlatpushError
from ..geometry.pose import Array

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

# x⁴ y⁴ z⁴ x³y x³z y³x y³z z³x z³y x²y² x²z² y²z² x²yz y²xz z²xy, as the variables that are multiplied.
MONOMIALS = ["xxxx", "yyyy", "zzzz", "xxxy", "xxxz", "yyyx", "yyyz", "zzzx", "zzzy", "xxyy", "xxzz", "yyzz"]
MONOMIALS += ["xxyz", "yyxz", "zzxy"]


@cache
def tensors() -> Array:
    """The symmetric tensors T (15, 3, 3, 3, 3) of the monomials."""
    T = np.zeros((15, 3, 3, 3, 3))
    for k, monomial in enumerate(MONOMIALS):
        places = set(permutations("xyz".index(letter) for letter in monomial))
        for place in places:
            T[(k, *place)] = 1 / len(places)
    return T


@cache
def minors() -> Array:
    """The Gram matrices (9, 9, 9) that stand for zero."""
    N = np.zeros((9, 9, 9))
    pairs = list(combinations(range(3), 2))
    for n, ((i, k), (j, m)) in enumerate(product(pairs, pairs)):
        for a, b, sign in ((3 * i + j, 3 * k + m, 1.0), (3 * i + m, 3 * k + j, -1.0)):
            N[n, a, b] = N[n, b, a] = sign / 2
    return N


def tensor(coefficients: Array) -> Array:
    """T (3, 3, 3, 3) of 15 coefficients."""
    return np.tensordot(coefficients, tensors(), axes=1)


def coefficients_of(T: Array) -> Array:
    """The 15 coefficients of a symmetric tensor."""
    counts = 1 / np.max(tensors().reshape(15, -1), axis=1)
    return np.array([T[tuple("xyz".index(letter) for letter in m)] for m in MONOMIALS]) * counts


def tensor_of_gram(gram: Array) -> Array:
    """The tensor of m(x, x)'Q m(x, x)/12, the quartic whose Hessian has the Gram matrix Q if any has."""
    Q = gram.reshape(3, 3, 3, 3)
    return sum((np.transpose(Q, p) for p in permutations(range(4))), np.zeros((3,) * 4)) / (24 * 12)


def gram_defect(gram: Array, T: Array) -> float:
    """The largest difference of m'Qm from the Hessian of T, as a form in y and x."""
    Q = gram.reshape(3, 3, 3, 3) - 12 * T  # [i, j, k, l]: yᵢ xⱼ yₖ xₗ
    Q = Q + np.transpose(Q, (2, 1, 0, 3))
    Q = Q + np.transpose(Q, (0, 3, 2, 1))
    return float(np.max(np.abs(Q)) / 4)


def best_gram(T: Array) -> Array:
    """The Gram matrix of T's Hessian with the largest least eigenvalue (Clarabel)."""
    base = 12 * T.reshape(9, 9)
    columns = [svec(-N) for N in minors()] + [svec(np.eye(9))]
    x = solve(
        np.array([0.0] * 9 + [-1.0]), np.stack(columns, axis=1), svec(base), [("psd", 9)], "the Gram matrix"
    )
    return base + np.tensordot(x[:9], minors(), axes=1)


def svec(matrix: Array) -> Array:
    """The upper triangle column by column, off-diagonals times √2, as the solver wants it."""
    rows, columns = np.tril_indices(len(matrix))
    scale = np.where(rows == columns, 1.0, np.sqrt(2.0))
    return matrix[columns, rows] * scale


def solve(cost: Array, A: "Array | csc_matrix", b: Array, cones: list[tuple[str, int]], what: str) -> Array:
    """The x of least cost·x with b - A x in the cones, by Clarabel; A is an array or a sparse matrix.

    Raises:
        FlatpushError: if the solver gives up.
    """
    import clarabel
    from scipy import sparse

    kinds = {
        "positive": clarabel.NonnegativeConeT,
        "norm": clarabel.SecondOrderConeT,
        "psd": clarabel.PSDTriangleConeT,
    }
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-9
    n = len(cost)
    solver = clarabel.DefaultSolver(
        sparse.csc_matrix((n, n)),
        cost,
        sparse.csc_matrix(A),
        b,
        [kinds[kind](size) for kind, size in cones],
        settings,
    )
    solution = solver.solve()
    x = np.array(solution.x)
    if str(solution.status) not in ("Solved", "AlmostSolved") or not np.isfinite(x).all():
        raise FlatpushError(f"{what} was not found: the solver says {solution.status}")
    return x
