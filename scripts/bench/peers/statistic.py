"""Errors against a reference that has an error of its own, and figures of merit."""

import numpy as np

# Squares of an image whose sums are compared [pixels].
BLOCK = 32


class Reference:
    """The mean of two programs' long runs, weighted by their mean relative variances: one weight a program, since
    weights by bin would prefer values that came out low. Bins without a positive value or a known error count in nothing."""

    def __init__(self, ours, theirs):
        first, second = ours.values, theirs.values
        # Of pixels that no reflected light reached in any batch Lampyris says that the error is not known.
        known = np.isfinite(ours.variance) & np.isfinite(theirs.variance)
        self.bins = known & np.isfinite(first) & (first > 0) & (second > 0)
        between = np.where(self.bins, (first + second) / 2, 1.0)
        relative = [np.mean((v / between**2)[self.bins]) for v in (ours.variance, theirs.variance)]
        self.claimed = [figure_of_merit(r, run.seconds) for r, run in zip(relative, (ours, theirs), strict=True)]
        share = relative[1] / (relative[0] + relative[1])
        self.share = share
        self.values = share * first + (1 - share) * second
        self.variance = share**2 * ours.variance + (1 - share) ** 2 * theirs.variance
        deviation = np.sqrt(ours.variance + theirs.variance)
        certain = self.bins & (deviation > 1e-6 * between)
        self.z = ((first - second)[certain]) / deviation[certain]
        self.of_totals = np.sum(first[self.bins]) / np.sum(second[self.bins]) - 1
        self.of_totals_error = np.sqrt(np.sum(theirs.variance[self.bins])) / np.sum(second[self.bins])
        self.blocks = block_difference(first, second, theirs.variance)
        self.own = np.mean((self.variance / between**2)[self.bins])

    def suffices(self, squared_error):
        """Whether the reference's error is less than half that of a run: else what is taken off decides."""
        return self.own < 0.25 * squared_error

    def deviations(self, values):
        return ((values - self.values) / np.where(self.bins, self.values, 1.0))[self.bins]

    def squared_error(self, values, chosen=None):
        """Mean squared relative error, that of the reference taken off; over the chosen bins."""
        within = self.bins if chosen is None else self.bins & chosen
        excess = (values - self.values) ** 2 - self.variance
        return np.mean(excess[within] / self.values[within] ** 2)

    def repeated_error(self, runs):
        """Root mean square of the relative error that all runs have in common: the bias, of independent runs."""
        deviations = [self.deviations(values) for values in runs]
        products = [np.mean(a * b) for i, a in enumerate(deviations) for b in deviations[:i]]
        return np.sqrt(max(0.0, np.mean(products) - self.own)) if products else np.nan


def block_difference(first, second, variance_of_second):
    """Root mean square of the relative differences between sums over squares of an image, and what of it is the error
    of the second; nothing for a grid, nor where a sum is zero."""
    side = round(len(first) ** 0.5)
    if side < 4 * BLOCK:
        return None

    def sums(values):
        return values.reshape(side // BLOCK, BLOCK, side // BLOCK, BLOCK).sum((1, 3)).ravel()

    lit = sums(second) > 0
    difference = (sums(first)[lit] - sums(second)[lit]) / sums(second)[lit]
    error = np.sqrt(sums(variance_of_second)[lit]) / sums(second)[lit]
    return np.sqrt(np.mean(difference**2)), np.sqrt(np.mean(error**2))


def figure_of_merit(squared_error, seconds):
    """1/(mean squared relative error x CPU seconds) [1/s]; NaN where the reference is no better than the run."""
    return 1 / (squared_error * seconds) if squared_error > 0 and seconds > 0 else np.nan
