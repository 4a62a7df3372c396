"""What a study's page says in sentences and facts: its answer in short, who, what was excluded, what made it."""

import re
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain

from sessions.prediction import BY_NAME, SED
from sessions.prediction.stored import UNKNOWNS
from sessions.report.contents import Fact
from sessions.report.facts import area_words, calibration_words, model_words
from sessions.report.prose import OTHER_FINGERS, friction_question
from sessions.report.tables.rivals import rivals_sentences
from sessions.report.tables.scales import psychometric_sentences, scale_sentences, study_functions
from sessions.report.tables.session import paths_sentence
from sessions.report.wording import capital, correlation, digits, full_stop, plural, shown_response, significant
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.scores import by_key
from sessions.statistics.visit import Exclusion

_FEW = 12  # trials named one by one


def question(study: StudyFindings) -> str:
    """Return what the study asks."""
    quantity = shown_response(study.response).in_full
    if not any(one.scores for one in study.descriptors):
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
    for one in study.descriptors:
        sentences += _relation_sentences(one, study)
        sentences += scale_sentences(one)
        sentences += [paths_sentence(one.descriptor, one.paths)] if one.paths else []
    if any(one.repeated is not None for one in study.descriptors):
        sentences.append(
            "With the receptor elsewhere or under the measured force the sign may differ, too, as the report of each "
            f"session says. {OTHER_FINGERS}"
        )
    sentences += chain.from_iterable(map(psychometric_sentences, study_functions(study)))
    if (f := study.friction) is not None:
        sentences.append(
            f"The µ of {f.strokes} strokes was estimated with a median error of "
            f"{digits(100 * f.median_error, 2)} %, {digits(100 * f.worst_error, 2)} % at worst; "
            f"{f.covered} of {f.intervals} intervals hold the true µ, and those of one subject hold or miss together, "
            "for the error of a transducer's calibration is one for all its strokes."
        )
    return sentences


def distinctions(study: StudyFindings) -> list[str]:
    """Return what scores can and cannot tell apart."""
    return [
        sentence
        for one in study.descriptors
        for kind, rivals in (("by means over subjects", one.rivals_of_means), ("within subjects", one.rivals))
        for sentence in rivals_sentences(f"{one.descriptor}, {kind}", rivals)
    ]


def _relation_sentences(one: DescriptorFindings, study: StudyFindings) -> list[str]:
    name, label = capital(one.descriptor), BY_NAME[study.response].label
    strain = study.options.prediction.kinematics
    other = "finite" if strain == "small" else "small"
    if one.repeated is None:
        trials = Counter(subject for subject, *_ in one.points)
        if sum(trials.values()) - len(trials) - 1 < 2:
            return [f"{name}: too few subjects with scores and strokes of their own for a correlation within subjects."]
        return [f"{name}: no correlation within subjects, in none of whom score and {label} both vary."]
    r = one.repeated
    interval = f"no interval from {plural(r.subjects, 'subject')} with two trials or more"
    if r.people is not None:
        low, high = map(correlation, r.people)
        interval = f"95 % interval for other people on these surfaces {low} to {high}"
    return [
        f"{name}: within subjects, score and the {label} predicted at {strain} strain go together by "
        f"r = {correlation(r.r)}, {interval}; {_otherwise(one, other)}."
    ]


def _otherwise(one: DescriptorFindings, other: str) -> str:
    """Return what the same trials give at the other strain, as far as the many paths went there."""
    usual = next((path.path for path in one.paths if path.usual), None)
    there = None if usual is None else replace(usual, kinematics=other)
    alternative = next((path for path in one.paths if path.path == there), None)
    if alternative is None:
        return f"at {other} strain, which was not tried here, the sign may differ"
    trials = plural(alternative.trials, "trial")
    if alternative.within is None or alternative.low is None or alternative.high is None:
        return f"at {other} strain {trials} of {len(one.points)} had a prediction, too few for a correlation"
    interval = f"{correlation(alternative.low)} to {correlation(alternative.high)}"
    return f"at {other} strain r = {correlation(alternative.within)} ({interval}) of the {trials} that have one there"


def who(study: StudyFindings) -> list[Fact]:
    """Return who took part."""
    subjects = sorted({visit.subject for visit in study.visits})
    strokers = sorted({visit.subject for visit in study.visits if visit.forces})
    protocols = sorted({visit.protocol for visit in study.visits})
    return [
        Fact("subjects", f"{len(subjects)}: {', '.join(subjects)}"),
        Fact("of them with forces", f"{len(strokers)}: {', '.join(strokers)}" if strokers else "none"),
        Fact("protocol", ", ".join(protocols)),
    ]


def exclusion_sentences(study: StudyFindings) -> list[str]:
    """Return a sentence for each thing that is excluded from the results, with who decided it and why."""
    sentences = [f"Session {name} could not be read, and nothing of it counts: {why}." for name, why in study.failed]
    sentences += [
        f"Session {session} holds the same recording as {first} (their SHA-256 agree), and counts nothing."
        for session, first in study.copies
    ]
    sentences += [
        f"Subject {one.subject}: {_whats(one)} left out by {one.who}: {full_stop(one.why)}"
        for one in study.excluded
        if _fits(study, one)
    ]
    return [*sentences, *_decision_sentences(study, leaving_out=True), *_trials_without_sed(study)]


def _decision_sentences(study: StudyFindings, *, leaving_out: bool) -> list[str]:
    """Return the decisions about strokes that leave one out, or all others."""
    decisions = [(visit.session, decision) for visit in study.visits for decision in visit.decisions]
    return [f"Session {name}: {full_stop(one)}" for name, one in decisions if (" is left out: " in one) == leaving_out]


NO_TRIAL = "has no trial of an experiment, as an imported table has none, and counts nothing"


def remarks(study: StudyFindings) -> list[str]:
    """Return what is missing though nobody excluded it, what people decided of what counts, and doubts about it."""
    sentences = _decision_sentences(study, leaving_out=False)
    sentences += [
        f"Session {visit.session} {'ended before its last trial; what it holds counts' if visit.rows else NO_TRIAL}."
        for visit in study.visits
        if not visit.complete
    ]
    sentences += [f"Session {visit.session}: {loss}." for visit in study.visits for loss in visit.losses]
    sentences += [
        f"The answers of session {visit.session} are {plural(choices, 'choice')} of one of two: they stand in the "
        "table of trials, no mean or correlation of scores is taken of them, and its strokes count as any other."
        for visit in study.visits
        if (choices := sum(row.choice is not None for row in visit.rows))
    ]
    sessions = by_key((v.subject, v.session) for v in study.visits if any(row.score is not None for row in v.rows))
    several = [f"{subject} in {', '.join(names)}" for subject, names in sessions.items() if len(names) > 1]
    sentences += [
        f"Scored in more than one session: {_first_few(several)}. In means a surface has the subject's mean score; "
        "within subjects every trial counts. Two people under one code would look the same."
    ] * bool(several)
    for outcome, words in (("not answered", "No score, for the subject did not answer"), ("open", "Not done")):
        places = [f"{v.session} trial {r.trial}" for v in study.visits for r in v.rows if r.outcome == outcome]
        sentences += [f"{words}: {_first_few(places)}."] if places else []
    sentences += [
        f"A decision of {one.who} leaves out {_whats(one)} of subject {one.subject} ({one.why}), and no session read "
        "has such trials; see exclusions.toml."
        for one in study.excluded
        if not _fits(study, one)
    ]
    sentences += [
        f"The {descriptor} scores of {subject} fall as the index rises (r = {correlation(r)}); the scale may have been "
        "used backwards."
        for subject, descriptor, r in study.reversed
    ]
    return [*sentences, *_meshes(study)]


def _meshes(study: StudyFindings) -> list[str]:
    """Return what it makes of the SEDs that sessions were not all solved on one mesh; nothing where they were."""
    meshes = by_key((value, v.session) for v in study.visits for name, value, _ in v.model if name == UNKNOWNS)
    errors = [row.error_estimate for visit in study.visits for row in visit.rows if row.error_estimate is not None]
    if len(meshes) < 2 or not errors:
        return []
    names = "; ".join(f"{value}: {_first_few(sessions)}" for value, sessions in meshes.items())
    sentence = (
        f"The sessions were solved on meshes of {len(meshes)} finenesses ({names}), each as fine as the differences "
        "between its own trials ask for. Within a subject all trials share one mesh; between subjects an SED may "
        f"differ for its mesh alone by as much as its estimated error, {_range_of(errors)} of it."
    )
    spreads = [
        s.response.sd / s.response.mean
        for one in study.descriptors
        for s in one.surfaces
        if s.response is not None and s.response.sd and study.response == SED.name  # whose errors these are
    ]
    if spreads:
        sentence += (
            f" Standard deviations between subjects are {_range_of(spreads)} of the SED of a surface: where they are "
            "no larger than that error, part of them may be the mesh."
        )
    return [sentence]


def _range_of(shares: Sequence[float]) -> str:
    return f"{significant(100 * min(shares), 2)} to {significant(100 * max(shares), 2)} %"


def _whats(one: Exclusion) -> str:
    return f"trials on {one.descriptor}" if one.descriptor else "every trial"


def _fits(study: StudyFindings, one: Exclusion) -> bool:
    """Say whether some session has a trial that a decision leaves out."""
    return any(v.subject == one.subject and one.descriptor in ("", r.descriptor) for v in study.visits for r in v.rows)


def _trials_without_sed(study: StudyFindings) -> list[str]:
    """Return which trials that were done have no SED, and why, those that differ in numbers alone together."""
    sentences: list[str] = []
    alike = by_key(
        (re.sub(r"[\d.]+", "#", row.why), (f"{visit.session} trial {row.trial}", row.why))
        for visit in study.visits
        for row in (visit.rows if visit.forces else ())
        if row.sed is None and row.why and row.outcome != "open"
    )
    for places in alike.values():
        names, reasons = _first_few([place for place, _ in places]), list(dict.fromkeys(reason for _, reason in places))
        why = f"{'' if len(reasons) == 1 else 'of the first: '}{full_stop(reasons[0])}"
        sentences.append(f"The model gives no SED for {plural(len(places), 'trial')} ({names}): {why}")
    return sentences


def _first_few(places: Sequence[str]) -> str:
    return ", ".join(places[:_FEW]) + (f" and {len(places) - _FEW} more" if len(places) > _FEW else "")


def seal_sentence(study: StudyFindings) -> str:
    """Return whether predictions were sealed before scores."""
    alike = by_key((visit.sealed, visit.session) for visit in study.visits if visit.sealed)
    if len(alike) == 1:
        ((sentence, sessions),) = alike.items()
        return sentence if len(sessions) == 1 else f"In each of {len(sessions)} sessions: {sentence}"
    return " ".join(f"{', '.join(sessions)}: {sentence}" for sentence, sessions in alike.items())


def model_facts(study: StudyFindings) -> list[Fact]:
    """Return the facts about the model; where sessions differ, each value with the first few that have it."""
    effects = by_key((name, (fact, visit.session)) for visit in study.visits for name, *fact in visit.model)
    facts: list[Fact] = []
    for name, pairs in effects.items():
        values = by_key(((value, remark), session) for (value, remark), session in pairs)
        for (value, remark), sessions in list(values.items())[:_FEW]:
            whose = "" if len(values) == 1 else f"in {_first_few(sessions)}"
            facts.append(Fact(name, value, "; ".join(part for part in (remark, whose) if part)))
    return facts


def again(study: StudyFindings) -> list[Fact]:
    """Return what the numbers were made with: options, versions, and the hash of each recording."""
    model = study.options.prediction
    facts = [
        Fact("strain of the model", model.kinematics),
        Fact("τ max", model.tau_reading),
        Fact("contact area", study.options.area.sentence),
        Fact("many paths", study.options.paths),
        Fact("held against scores", BY_NAME[study.response].label, BY_NAME[study.response].meaning),
    ]
    software = by_key((", ".join(map(" ".join, visit.made_by.items())), visit.session) for visit in study.visits)
    facts += [Fact("computed with", text, f"{plural(len(sessions), 'session')}") for text, sessions in software.items()]
    facts += [Fact(visit.session, f"SHA-256 {visit.sha256}", "session.sqlite") for visit in study.visits]
    return [fact for fact in facts if fact.value]


def command(study: StudyFindings, name: str) -> str:
    """Return what to type to get the same numbers, where the study's folder lies or is to be made."""
    options = study.options
    model = options.prediction
    usual = model.kinematics == "small"  # see 'daq-app study --intervals'
    words = ["daq-app", "study", shlex.quote(name)]
    if study.synthetic is not None:
        words = ["daq-app", "study", "--synthetic", str(study.synthetic), "--out", shlex.quote(name)]
    words += [*model_words(model), *area_words(options.area), *calibration_words(options.gain_error)]
    words += [] if study.response == SED.name else ["--quantity", study.response]
    words += [] if model.intervals == usual else ["--intervals" if model.intervals else "--no-intervals"]
    words += {"none": [], "small": ["--paths"], "finite": ["--paths", "finite"]}[options.paths]
    return " ".join(words)
