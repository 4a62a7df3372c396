"""The hard cases at small and at finite strain: a named, repeatable suite for tests, page and docs.

A case is a scene or a body. Some require an answer, others an answer or the reason why no state exists. A case passes
when its outcome meets that, is in balance, violates no law, has no nan, and agrees with a neighbouring case.
"""

from solver.verification.hard_cases.suite import Case, HardCase, cases, judge, measure

__all__ = ["Case", "HardCase", "cases", "judge", "measure"]
