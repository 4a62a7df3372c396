"""The hard cases, at small and at finite strain: a named, repeatable suite for tests, page and docs.

A case is a scene or a body, and what must happen: an answer, an answer where a state exists and else a reason. It
passes when what came out is that, balances, exceeds no law, holds no nan, and is what a neighbouring case gives.
"""

from solver.verification.hard_cases.suite import Case, HardCase, cases, judge, measure

__all__ = ["Case", "HardCase", "cases", "judge", "measure"]
