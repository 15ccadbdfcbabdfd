"""A claim's statistic as it is read: numbers with their units, and a plot of the interval."""

from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from studies.claims.claims import Claim
from studies.words import write_number

UNITS = ("%", "points", "τ")
MARGIN = 0.08  # left and right in a plot, as a share of what it shows
SPACE = "\u202f"  # narrow, and no line breaks there


@dataclass(frozen=True)
class Estimate:
    """The statistic of a claim over the replicates, with both verdicts and their intervals."""

    claim: Claim
    mean: float
    low: float
    high: float
    verdict: str
    mean_low: float
    mean_high: float
    population: str
    pooled: float | None = None  # of the trials of all replicates together

    @property
    def unit(self) -> str:
        """``%``, ``points`` for a difference of percentages, or ``τ`` for correlations."""
        if not self.claim.rule.is_percentage:
            return "τ"
        return "points" if self.claim.is_difference else "%"

    @property
    def number(self) -> str:
        """The mean."""
        return self.write(self.mean) if self.is_finite else "undefined"

    @property
    def value(self) -> str:
        """The mean with its unit."""
        return f"{self.number}{SPACE}{self.unit}" if self.is_finite else self.number

    @property
    def interval(self) -> str:
        """The interval, in the unit of the mean."""
        return f"[{self.write(self.low)}, {self.write(self.high)}]" if self.is_finite else ""

    @property
    def mean_interval(self) -> str:
        """The confidence interval of the mean, in its unit."""
        bounds = (self.mean_low, self.mean_high)
        return f"[{', '.join(map(self.write, bounds))}]" if self.is_finite else ""

    @property
    def expected(self) -> str:
        """The paper's number, or the criterion that stands for its words."""
        if self.claim.paper is not None:
            return f"{write_number(self.claim.paper, 0, signed=True)}{SPACE}{self.unit}"
        relation, bound = self.claim.bound
        sign = "±" if relation == "within" else ""
        return f"{relation} {sign}{bound:g}{SPACE}{self.unit}".replace("-", "−")

    @property
    def is_finite(self) -> bool:
        """Whether the statistic is defined in every replicate."""
        return all(map(isfinite, (self.low, self.mean, self.high)))

    @property
    def key(self) -> str:
        """What to sort by: the unit, then the mean. Empty where it is undefined."""
        return f"{UNITS.index(self.unit)} {self.mean:g}" if self.is_finite else ""

    @property
    def expected_key(self) -> str:
        """What to sort the paper's numbers by, and the criteria behind them."""
        if self.claim.paper is not None:
            return f"0 {self.claim.paper:g}"
        return f"{1 + UNITS.index(self.unit)} {self.claim.bound[1]:g}"

    @property
    def plot(self) -> dict[str, Any] | None:
        """The interval beside what it is compared with, from 0 at the left to 100 at the right."""
        if not self.is_finite:
            return None
        lowest, highest = self.claim.interval
        bounds = [bound for bound in (lowest, highest) if isfinite(bound)]
        marks = bounds if self.claim.paper is None else [self.claim.paper]
        whole = [self.low, self.high, *bounds]
        if self.unit == "τ":
            whole += [0.0, 1.0]  # on one scale from claim to claim
        margin = MARGIN * (max(whole) - min(whole))
        ends = min(whole) - margin, max(whole) + margin
        shown = [self.low, self.mean, self.high, lowest, highest, *marks]
        low, mean, high, first, last, *marks = np.interp(shown, ends, (0, 100)).round(1).tolist()
        return {"low": low, "mean": mean, "high": high, "holds": (first, last), "marks": marks}

    def write(self, value: float) -> str:
        """Write a number in the unit of the mean."""
        signed = self.claim.rule.has_ranges or self.claim.is_difference
        return write_number(value, 1 if self.claim.rule.is_percentage else 3, signed=signed)
