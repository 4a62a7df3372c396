"""The experiments of a session: who scored what, and how predictions go with it."""

from collections.abc import Mapping, Sequence

from sessions.plan.plan import Block, SessionPlan
from sessions.report.contents import Answers, Experiment
from sessions.statistics.multiverse import PathTrial, Seds, path_findings
from sessions.statistics.scores import MeanScore, Relation, ScoreTable, mean_scores, relation, score_matrix
from sessions.strokes.contact_area import FIXED, AreaLaw
from sessions.strokes.friction import rule_for


def experiments(
    plan: SessionPlan,
    tables: Sequence[ScoreTable],
    seds: Mapping[tuple[str, int], float],
    paths: Mapping[int, Seds] | None = None,
    law: AreaLaw = FIXED,
) -> tuple[Experiment, ...]:
    """Return one experiment a block; `seds` holds the predicted SED [MPa] by block and index, where there is one.

    `paths` holds the SED of each trial along many paths of the analysis, where they were asked for, and `law` the
    contact area by which every other number was told.
    """
    means = mean_scores(tables)
    return tuple(
        _experiment(block, means, tables, seds, paths or {}, law) for block in plan.blocks if block.phase == "main"
    )


def _experiment(
    block: Block,
    means: Sequence[MeanScore],
    tables: Sequence[ScoreTable],
    seds: Mapping[tuple[str, int], float],
    paths: Mapping[int, Seds],
    law: AreaLaw,
) -> Experiment:
    descriptor = block.trials[0].stimulus.descriptor
    indices = tuple(sorted({trial.stimulus.known_index for trial in block.trials}))
    told = tuple(mean for mean in means if mean.descriptor == descriptor and mean.index in indices)
    score_of = {mean.index: mean.mean for mean in told}
    predicted = {index: seds[block.name, index] for index in indices if (block.name, index) in seds}
    return Experiment(
        name=block.name,
        descriptor=descriptor,
        instruction=block.instruction,
        direction=block.direction,
        indentation=block.indentation,
        scale_ends=block.scale_ends,
        indices=indices,
        scores=told,
        answers=tuple(
            Answers(subject, tuple(given.get(index) for index in indices))
            for subject, given in score_matrix(tables, descriptor).items()
        ),
        score_relation=_related(score_of, predicted),
        index_relation=_related({index: float(index) for index in indices}, predicted),
        paths=path_findings(
            [
                PathTrial("", index, score_of.get(index), rule_for(trial), paths.get(trial.number, ()))
                for trial in block.trials
                for index in [trial.stimulus.known_index]
            ],
            "small",
            law,
            within=False,
        ),
    )


def _related(x: Mapping[int, float], seds: Mapping[int, float]) -> Relation | None:
    """Return how the SEDs go with x, over the indices that have both; None where there is none."""
    both = [index for index in x if index in seds]
    if not both:
        return None
    return relation([x[index] for index in both], [seds[index] for index in both], both)
