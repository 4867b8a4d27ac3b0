"""How far an estimate is from a truth that is affine in disparity."""

import numpy as np

#: Of `score`, in its order.
NAMES = ("AI(1)", "AI(2)", "1 − abs ρ", "MAE, m", "AbsRel", "δ1", "within σ", "within 2 σ")


def ranks(values):
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    return (ends - 0.5 * (counts + 1))[inverse]


def score(estimate, sigma, truth, where, is_inverse_depth=False):
    """The numbers of `NAMES` at the pixels `where`; NaN where one does not apply.

    AI(p): min over a, b of (mean |truth - (a estimate + b)|^p)^(1/p). The rest after the fit of AI(1): errors of depth
    where the truth is 1/depth, and the parts of the errors within one and two sigma.
    """
    answer = np.full(len(NAMES), np.nan)
    use = where & np.isfinite(truth)
    if use.sum() < 10:
        return answer
    e, t = estimate[use].astype(float), truth[use]
    middle, spread = e.mean(), max(e.std(), 1e-12)
    columns = np.stack([(e - middle) / spread, np.ones_like(e)], 1)
    fit = squares = np.linalg.lstsq(columns, t, rcond=None)[0]
    for _ in range(60):
        weighted = columns / np.maximum(np.abs(t - columns @ fit), 1e-4)[:, None]
        fit = np.linalg.lstsq(weighted.T @ columns, weighted.T @ t, rcond=None)[0]
    rho = np.corrcoef(ranks(e), ranks(t))[0, 1] if e.std() > 0 else 0.0
    off = np.abs(t - columns @ fit)
    answer[:3] = off.mean(), np.sqrt(np.mean((t - columns @ squares) ** 2)), 1 - abs(rho)
    if is_inverse_depth:
        # Nothing is farther than ten times the farthest truth.
        depth = 1 / np.maximum(columns @ fit, 0.1 * t.min())
        answer[3] = np.mean(np.abs(depth - 1 / t))
        answer[4] = np.mean(np.abs(depth * t - 1))
        answer[5] = np.mean(np.maximum(depth * t, 1 / (depth * t)) < 1.25)
    if sigma is not None:
        off /= max(abs(fit[0]) / spread, 1e-12)
        answer[6:] = [np.mean(off < k * sigma[use]) for k in (1, 2)]
    return answer
