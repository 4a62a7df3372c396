"""Sentences and facts of a study's page: summary, participants, exclusions, reproduction."""

import re
import shlex
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import chain

from sessions.prediction import BY_NAME, SED
from sessions.prediction.stored import UNKNOWNS
from sessions.report.contents import Fact
from sessions.report.facts import analysis_arguments, model_arguments
from sessions.report.prose import OTHER_FINGERS, friction_question
from sessions.report.tables.rivals import levels_of_rivals, rivals_sentences
from sessions.report.tables.scales import psychometric_sentences, scale_sentences, study_functions
from sessions.report.tables.session import paths_sentence
from sessions.report.wording import (
    capital,
    correlation,
    digits,
    direction,
    full_stop,
    plural,
    reversal_sentence,
    shown_response,
    significant,
    spread_share,
)
from sessions.statistics.correlations import LEAST_CASES
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.multiverse import Kinematics
from sessions.statistics.scores import by_key
from sessions.statistics.visit import STILL_BLINDED, Exclusion, TrialRow, exclusion_of
from sessions.statistics.within_subjects import RepeatedCorrelation
from sessions.strokes.stroke import FIXED

_MOST_NAMED = 12  # names listed in full


def question(study: StudyFindings) -> str:
    """Return the study's question."""
    quantity = shown_response(study.response).in_full
    if not any(findings.scores for findings in study.descriptors):
        forces = any(visit.forces for visit in study.visits)
        return f"People stroke surfaces and judge what they feel. {friction_question(quantity if forces else '')}"
    return (
        f"People stroke surfaces and scale what they feel. Does the {quantity} that a "
        "finger model predicts at a receptor, from the friction of the same people's own strokes, follow their scores?"
    )


def summary(study: StudyFindings) -> list[str]:
    """Return the findings in short, a sentence each."""
    subjects = {visit.subject for visit in study.visits}
    verb = "was" if len(study.visits) == 1 else "were"
    sentences = [f"{plural(len(study.visits), 'session')} of {plural(len(subjects), 'subject')} {verb} read."]
    sentences += [] if study.descriptors else ["No trial counts."]
    for findings in study.descriptors:
        sentences += _relation_sentences(findings, study)
        sentences += scale_sentences(findings)
        sentences += (
            [paths_sentence(findings.descriptor, findings.paths, findings.single_subject)] if findings.paths else []
        )
    sentences += _different_settings(study)
    if any(findings.repeated is not None for findings in study.descriptors):
        sentences.append(
            "With the receptor elsewhere or under the measured force the sign may differ, too, as the report of each "
            f"session says. {OTHER_FINGERS}"
        )
    sentences += chain.from_iterable(map(psychometric_sentences, study_functions(study)))
    if (friction := study.friction) is not None:
        sentences.append(
            f"The µ of {friction.strokes} strokes was estimated with a median error of "
            f"{digits(100 * friction.median_error, 2)} %, {digits(100 * friction.worst_error, 2)} % at worst; "
            f"{friction.covered} of {friction.intervals} intervals hold the true µ; those of one subject hold or miss "
            "it together, since one calibration error affects all its strokes."
        )
    return sentences


def distinctions(study: StudyFindings) -> list[str]:
    """Return sentences on the rivals that scores can and cannot distinguish."""
    return [
        sentence
        for findings in study.descriptors
        for name, rivals in levels_of_rivals(findings)
        for sentence in rivals_sentences(name, rivals)
    ]


def _relation_sentences(findings: DescriptorFindings, study: StudyFindings) -> list[str]:
    name, label = capital(findings.descriptor), BY_NAME[study.response].label
    strain = study.options.prediction.kinematics
    other_strain = "finite" if strain == "small" else "small"
    if not findings.scores:
        return [f"{name}: there are no scores to compare the {label} with."]
    if findings.repeated is None:
        trials = Counter(subject for subject, *_ in findings.points)
        if sum(trials.values()) - len(trials) - 1 < 2:
            within = "" if findings.single_subject else " within subjects"
            return [f"{name}: too few trials have both a score and a predicted {label} to correlate them{within}."]
        if findings.single_subject:
            return [f"{name}: no correlation, since score and {label} do not both vary over the trials."]
        return [f"{name}: no correlation within subjects, since score and {label} both vary in none of them."]
    repeated = findings.repeated
    interval = f"no interval from {plural(repeated.subjects, 'subject')} with two trials or more"
    if findings.single_subject:
        interval = "no interval for other people from one subject"
    elif repeated.subjects >= LEAST_CASES:
        interval = "no interval, since subjects are alike or r is perfect"
    if repeated.people is not None:
        low, high = map(correlation, repeated.people)
        interval = f"95 % interval for other people on these surfaces {low} to {high}"
    falling = sum(descriptor == findings.descriptor for _, descriptor, _ in study.reversed)
    people = findings.single_subject or plural(len({subject for subject, *_ in findings.points}), "subject")
    level = "" if findings.single_subject else "within subjects, "
    surfaces = plural(len({index for _, index, *_ in findings.points}), "surface")
    means = [surface.response.mean for surface in findings.surfaces if surface.response is not None]
    return [
        f"{name}: {level}score and the {label} predicted at {strain} strain go together by "
        f"r = {correlation(repeated.r)} over {plural(len(findings.points), 'trial')} of {people} on {surfaces}, "
        f"{interval}; over the surfaces the mean {label} has a range of {spread_share(min(means), max(means))}; "
        f"{_otherwise(findings, other_strain)}.",
        *_subsets(findings),
        *([reversal_sentence(findings.descriptor, falling, len(findings.answers))] if falling else []),
    ]


def _subsets(findings: DescriptorFindings) -> list[str]:
    """Return sentences on r without trials that no finger can be in, and within blocks, where either differs."""
    cases: list[tuple[str, RepeatedCorrelation | None]] = []
    if findings.repeated_in_blocks is not None:
        cases.append(("within each block of a subject", findings.repeated_in_blocks))
    if findings.doubtful:
        trials = plural(findings.doubtful, "trial")
        cases.append((f"without {trials} in a state that no finger can be in", findings.repeated_possible))
    return [f"{capital(findings.descriptor)}, {case}: {_r_in_short(repeated)}." for case, repeated in cases]


def _r_in_short(repeated: RepeatedCorrelation | None) -> str:
    if repeated is None:
        return "too few trials for a correlation, or no variation"
    low_to_high = "no interval" if repeated.people is None else " to ".join(map(correlation, repeated.people))
    return f"r = {correlation(repeated.r)} ({low_to_high})"


def _otherwise(findings: DescriptorFindings, other_strain: Kinematics) -> str:
    """Return a clause on the same trials at the other strain, from the paths if they include it."""
    usual = next((path.path for path in findings.paths if path.usual), None)
    other_path = None if usual is None else replace(usual, kinematics=other_strain)
    alternative = next((path for path in findings.paths if path.path == other_path), None)
    if alternative is None:
        return f"at {other_strain} strain, which was not tried here, the sign may differ"
    trials = plural(alternative.trials, "trial")
    if alternative.within is None:
        return f"at {other_strain} strain no correlation, of {trials} with a score and a prediction there"
    interval = "no interval"
    if alternative.low is not None and alternative.high is not None:
        interval = f"{correlation(alternative.low)} to {correlation(alternative.high)}"
    r = correlation(alternative.within)
    return f"at {other_strain} strain r = {r} ({interval}) over the {trials} with a prediction there"


def subject_facts(study: StudyFindings) -> list[Fact]:
    """Return the participants."""
    subjects = sorted({visit.subject for visit in study.visits})
    strokers = sorted({visit.subject for visit in study.visits if visit.forces})
    protocols = sorted({visit.protocol for visit in study.visits})
    return [
        Fact("subjects", f"{len(subjects)}: {', '.join(subjects)}"),
        Fact("of them with forces", f"{len(strokers)}: {', '.join(strokers)}" if strokers else "none"),
        Fact("protocol", ", ".join(protocols)),
    ]


def exclusion_sentences(study: StudyFindings) -> list[str]:
    """Return a sentence for each exclusion from the results, with its author and reason."""
    sentences = [f"Session {name} could not be read and is not counted: {text}." for name, text in study.failed]
    sentences += [f"Session {name} is {STILL_BLINDED}." for name in study.blinded]
    sentences += [
        f"Session {session} holds the same recording as {first}, to the last reading and event, and is not counted."
        for session, first in study.copies
    ]
    sentences += [
        f"Subject {exclusion.subject}: {_trials_of(exclusion)} left out by {exclusion.who}: {full_stop(exclusion.why)}"
        for exclusion in study.excluded
        if exclusion not in study.misfits
    ]
    return [*sentences, *_decision_sentences(study, leaving_out=True), *_trials_without_sed(study)]


def _decision_sentences(study: StudyFindings, *, leaving_out: bool) -> list[str]:
    """Return the decisions that leave a stroke out, or all other decisions."""
    decisions = [(visit.session, decision) for visit in study.visits for decision in visit.decisions]
    return [f"Session {name}: {full_stop(s)}" for name, s in decisions if (" is left out: " in s) == leaving_out]


NO_TRIAL = "has no trial of an experiment, as an imported table has none, and is not counted"


def remarks(study: StudyFindings) -> list[str]:
    """Return sentences on missing data, decisions on what counts, and doubts."""
    sentences = _decision_sentences(study, leaving_out=False)
    sentences += [
        f"Session {visit.session} {'ended before its last trial; what it holds counts' if visit.rows else NO_TRIAL}."
        for visit in study.visits
        if not visit.complete
    ]
    sentences += [f"Session {visit.session}: {loss}." for visit in study.visits for loss in visit.losses]
    sentences += [
        f"The answers of session {visit.session} are {plural(choices, 'choice')} of one of two: the table of trials "
        "lists them, no mean or correlation of scores includes them, and its strokes count as any other."
        for visit in study.visits
        if (choices := sum(row.choice is not None for row in visit.rows))
    ]
    sessions = by_key((v.subject, v.session) for v in study.visits if any(row.score is not None for row in v.rows))
    several = [f"{subject} in {', '.join(names)}" for subject, names in sessions.items() if len(names) > 1]
    if several:
        sentences.append(
            f"Scored in more than one session: {_first_few(several)}. In means a surface has the subject's mean score; "
            "within subjects every trial counts. Two people under one code would look the same."
        )
    for outcome, opening in (("not answered", "No score, because the subject did not answer"), ("open", "Not done")):
        trials = [f"{v.session} trial {r.trial}" for v in study.visits for r in v.rows if r.outcome == outcome]
        sentences += [f"{opening}: {_first_few(trials)}."] if trials else []
    descriptors = ", ".join(sorted({row.descriptor for visit in study.visits for row in visit.rows})) or "nothing"
    sentences += [
        f"A decision of {exclusion.who} leaves out {_trials_of(exclusion)} of subject {exclusion.subject} "
        f"({exclusion.why}), and no session read has such trials, only trials on {descriptors}; see exclusions.toml."
        for exclusion in study.misfits
    ]
    sentences += [
        f"The {descriptor} scores of {subject} fall as the index rises (r = {correlation(r)}); the scale may have been "
        "used backwards, or these scores may follow no order."
        for subject, descriptor, r in study.reversed
    ]
    return [*sentences, *_doubtful_trials(study), *_meshes(study)]


# What sets a prediction besides a stroke's friction, and its text
_SETTINGS: Mapping[str, Callable[[TrialRow], str]] = {
    "depth of the model": lambda row: "" if row.indentation is None else f"{row.indentation:g} mm",
    "contact area": lambda row: "" if row.contact_area is None else f"{row.contact_area:g} mm²",
    "direction": lambda row: direction(row.direction),
    "µ of the model": lambda row: row.rule,
}


def _different_settings(study: StudyFindings) -> list[str]:
    """Return a sentence for each descriptor whose counted trials are predicted with different settings."""
    sentences: list[str] = []
    copies = dict(study.copies)
    for findings in study.descriptors:
        name = findings.descriptor
        rows = [
            (visit.session, [row for row in visit.rows if row.descriptor == name and row.sed is not None])
            for visit in study.visits
            if visit.session not in copies and exclusion_of(study.excluded, visit.subject, name) is None
        ]
        clauses: list[str] = []
        for setting, text in _SETTINGS.items():
            if setting == "contact area" and study.options.area != FIXED:
                continue  # it grows with the force of each stroke
            values = by_key(
                (" and ".join(sorted(set(map(text, trials)))), session) for session, trials in rows if trials
            )
            parts = [f"{value}: {_first_few(sessions)}" for value, sessions in values.items()]
            if len(values) == 1:
                parts = [f"{value} in each session" for value in values if " and " in value]
            clauses += [f"{setting} ({'; '.join(parts)})"] if parts else []
        if clauses:
            sentences.append(
                f"Trials on {name} are predicted with different settings: {', '.join(clauses)}. Means, correlations "
                "and models pool them, so part of the differences between trials may come from these settings."
            )
    return sentences


def _meshes(study: StudyFindings) -> list[str]:
    """Return a sentence on the effect of different meshes on the SEDs; empty if all sessions share one."""
    meshes = by_key((value, v.session) for v in study.visits for name, value, _ in v.model if name == UNKNOWNS)
    errors = [row.error_estimate for visit in study.visits for row in visit.rows if row.error_estimate is not None]
    if len(meshes) < 2 or not errors:
        return []
    names = "; ".join(f"{value}: {_first_few(sessions)}" for value, sessions in meshes.items())
    sentence = (
        f"The sessions were solved on meshes of {len(meshes)} finenesses ({names}), each as fine as the differences "
        "between its own trials require. Within a subject all trials share one mesh; between subjects an SED may "
        f"differ because of its mesh alone by as much as its estimated error, {_range_of(errors)} of it."
    )
    spreads = [
        surface.response.sd / surface.response.mean
        for findings in study.descriptors
        for surface in findings.surfaces
        if surface.response is not None and surface.response.sd and study.response == SED.name  # errors are of the SED
    ]
    if spreads:
        sentence += (
            f" Standard deviations between subjects are {_range_of(spreads)} of the SED of a surface: where they are "
            "no larger than that error, part of them may be the mesh."
        )
    return [sentence]


def _range_of(shares: Sequence[float]) -> str:
    return f"{significant(100 * min(shares), 2)} to {significant(100 * max(shares), 2)} %"


def _trials_of(exclusion: Exclusion) -> str:
    return f"trials on {exclusion.descriptor}" if exclusion.descriptor else "every trial"


def _doubtful_trials(study: StudyFindings) -> list[str]:
    """Return a sentence on trials whose prediction counts, though no finger can be in its state."""
    doubts = [(f"{v.session} trial {row.trial}", row.doubt) for v in study.visits for row in v.rows if row.doubt]
    if not doubts:
        return []
    names, sentence = _first_few([name for name, _ in doubts]), doubts[0][1]
    return [
        f"Predictions of {plural(len(doubts), 'trial')} are, on their meshes, of a state that no finger can be in, and "
        f"count nevertheless ({names}). {'Of the first: ' if len(doubts) > 1 else ''}{full_stop(sentence)}"
    ]


def _trials_without_sed(study: StudyFindings) -> list[str]:
    """Return sentences on completed trials without an SED; reasons that differ only in numbers are merged."""
    sentences: list[str] = []
    alike = by_key(
        (re.sub(r"[\d.]+", "#", row.why), (f"{visit.session} trial {row.trial}", row.why))
        for visit in study.visits
        for row in (visit.rows if visit.forces else ())
        if row.sed is None and row.why and row.outcome != "open"
    )
    for trials in alike.values():
        names, reasons = _first_few([trial for trial, _ in trials]), list(dict.fromkeys(reason for _, reason in trials))
        reason = f"{'' if len(reasons) == 1 else 'of the first: '}{full_stop(reasons[0])}"
        sentences.append(f"The model gives no SED for {plural(len(trials), 'trial')} ({names}): {reason}")
    return sentences


def _first_few(names: Sequence[str]) -> str:
    omitted = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {omitted} more" if omitted > 0 else "")


def seal_sentence(study: StudyFindings) -> str:
    """Return a sentence on whether predictions were sealed before scores."""
    alike = by_key((visit.sealed, visit.session) for visit in study.visits if visit.sealed)
    if len(alike) == 1:
        ((sentence, sessions),) = alike.items()
        return sentence if len(sessions) == 1 else f"In each of {len(sessions)} sessions: {sentence}"
    return " ".join(f"{', '.join(sessions)}: {sentence}" for sentence, sessions in alike.items())


def model_facts(study: StudyFindings) -> list[Fact]:
    """Return the facts about the model; where sessions differ, each value with the first few sessions."""
    effects = by_key((name, (fact, visit.session)) for visit in study.visits for name, *fact in visit.model)
    facts: list[Fact] = []
    for name, pairs in effects.items():
        values = by_key(((value, remark), session) for (value, remark), session in pairs)
        for (value, remark), sessions in list(values.items())[:_MOST_NAMED]:
            sessions_text = "" if len(values) == 1 else f"in {_first_few(sessions)}"
            facts.append(Fact(name, value, "; ".join(text for text in (remark, sessions_text) if text)))
    return facts


def reproduction_facts(study: StudyFindings) -> list[Fact]:
    """Return the facts for reproduction: options, versions, and the hash of each recording."""
    model = study.options.prediction
    facts = [
        Fact("strain of the model", model.kinematics),
        Fact("τ max", model.tau_reading),
        Fact("contact area", study.options.area.sentence),
        Fact("many paths", study.options.paths),
        Fact("compared with scores", BY_NAME[study.response].label, BY_NAME[study.response].meaning),
    ]
    software = by_key((", ".join(map(" ".join, visit.made_by.items())), visit.session) for visit in study.visits)
    facts += [Fact("computed with", text, f"{plural(len(sessions), 'session')}") for text, sessions in software.items()]
    facts += [Fact(visit.session, f"SHA-256 {visit.sha256}", "session.sqlite") for visit in study.visits]
    return [fact for fact in facts if fact.value]


def command(study: StudyFindings, name: str) -> str:
    """Return the command that reproduces the numbers, run in the parent of the study's folder."""
    options = study.options
    model = options.prediction
    usual = model.kinematics == "small"  # see 'daq-app study --intervals'
    arguments = ["daq-app", "study", shlex.quote(name)]
    if study.synthetic is not None:
        arguments = ["daq-app", "study", "--synthetic", str(study.synthetic), "--out", shlex.quote(name)]
    arguments += [*model_arguments(model), *analysis_arguments(options.area, options.gain_error)]
    arguments += [] if study.response == SED.name else ["--quantity", study.response]
    arguments += [] if model.intervals == usual else ["--intervals" if model.intervals else "--no-intervals"]
    arguments += {"none": [], "small": ["--paths"], "finite": ["--paths", "finite"]}[options.paths]
    return " ".join(arguments)
