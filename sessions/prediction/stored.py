"""Predictions for each trial, each variant and a session, and their form as plain data."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Annotated, Any, Literal, cast

import msgspec

from sessions.plan.plan import Stimulus
from sessions.prediction.options import Kinematics, PredictionOptions, TauReading, template
from sessions.recording.derived import complete
from sessions.strokes import Analysis
from sessions.strokes.decisions import Decision
from sessions.strokes.stroke import Meaning
from sessions.toml_file import from_table
from solver import Prediction, Scene
from solver.prediction import History, Response, Skin
from solver.response.fields import Fields, fields_of

Method = Literal["derivatives", "sampling"]  # by the solver's converged tangent; by solved draws
Ends = tuple[float, float]
Number = float | None


@dataclass(frozen=True, slots=True)
class SedInterval:
    """The 95 % interval of one SED from friction, and from a driving force: not the model's error.

    Includes intervals of the state's forces and depth, from the tangent alone; None without a tangent.
    """

    low: float | None  # [MPa]; None where `reason` says why
    high: float | None
    method: Method | None
    # Derivatives from the converged tangent; with sampling they hold only close to the measured friction
    by_mu: float | None = None  # of the SED by mu [MPa]
    by_tau_max: float | None = None  # by tau_max in the model's reading [-]
    by_force: float | None = None  # by the normal force, where it drives the model [MPa/N]
    reason: str = ""
    normal_force: Ends | None = None  # of the whole finger [N]
    tangential_force: Ends | None = None  # [N]
    indentation: Ends | None = None  # under a force [mm]; both ends equal where it was given


Driven = Literal["depth", "force", "other way"]


@dataclass(frozen=True, slots=True)
class Variant:
    """A variant of a prediction."""

    kinematics: Annotated[Kinematics, Meaning("", "small or finite strain")]
    tau_reading: Annotated[TauReading, Meaning("", "of tau_max: computed, or as-printed (a hundredth)")]
    driven: Annotated[Driven, Meaning("", "by depth, by force (measured), or by depth the other way")]

    @property
    def sentence(self) -> str:
        """The variant, for people.

        >>> Variant("finite", "as-printed", "depth").sentence
        'finite strain, tau_max as printed, at the planned depth'
        """
        return f"{self.kinematics} strain, {self.conditions}"

    @property
    def conditions(self) -> str:
        """The variant without the strain, for people."""
        reading = "tau_max as printed, " if self.tau_reading == "as-printed" else ""
        return f"{reading}{_DRIVEN[self.driven]}"


_DRIVEN = {
    "depth": "at the planned depth",
    "force": "at the measured force",
    "other way": "at the planned depth, slid the other way",
}


_KINDS: Mapping[str, tuple[Kinematics, ...]] = {"none": (), "small": ("small",), "both": ("small", "finite")}


@dataclass(frozen=True, slots=True)
class Alternative:
    """The settled state of a trial in one variant. A number is None where `reason` says why."""

    variant: Variant
    tau_max: Annotated[Number, Meaning("MPa", "traction bound the model was given")]
    indentation: Annotated[Number, Meaning("mm", "given, or found under the force")]
    sed: Annotated[Number, Meaning("MPa", "strain-energy density averaged over the ending")]
    error_estimate: Annotated[Number, Meaning("", "relative, of sed")]
    normal_force: Annotated[Number, Meaning("N", "the model's, times the finger's width")]
    tangential_force: Annotated[Number, Meaning("N", "likewise")]
    reason: Annotated[str, Meaning("", "why there is no number")] = ""
    traction: float | None = None  # greatest friction traction on the skin: below tau_max the bound has no effect [MPa]
    interval: SedInterval | None = None  # of the SED, where requested
    normal_force_error: float | None = None  # estimated by the solver, of normal_force, relative [-]; None: given
    tangential_force_error: float | None = None  # the same for tangential_force
    indentation_error: float | None = None  # the same for the indentation; None where it was given
    doubt: str = ""  # a warning where the model was driven beyond its range


def variants(choice: Literal["none", "small", "both"]) -> Iterator[Variant]:
    """Yield the variants of a choice: at small strain, or also at finite strain."""
    for kinematics in _KINDS[choice]:
        yield Variant(kinematics, "computed", "depth")
        yield Variant(kinematics, "as-printed", "depth")
        yield Variant(kinematics, "computed", "force")
        yield Variant(kinematics, "computed", "other way")


_OPTIONAL = ("interval", "opposite_interval")  # of a row as plain data: absent unless requested
_PARTS = ("stimulus", *_OPTIONAL)

# Names of options until 2026-11-26, and present names. Documents hold both for one release.
_PRESENT_NAMES = {"beside": "variants", "beside_intervals": "variant_intervals"}


def known_error(prediction: Prediction, error: float | None) -> float | None:
    """Return a relative error of a prediction [-], or None where it is unknown."""
    return None if prediction.nested is None else error


def settled_numbers(answer: Prediction) -> dict[str, Any]:
    """Return SED [MPa] and forces of the whole finger [N] with relative errors, by their names in `TrialNumbers`."""
    width = answer.scene.finger.width
    return {
        "sed": answer.sed_ending,
        "error_estimate": known_error(answer, answer.error_estimate),
        "normal_force": answer.normal_force * width,
        "tangential_force": answer.tangential_force * width,
        "normal_force_error": known_error(answer, answer.normal_force_error),
        "tangential_force_error": known_error(answer, answer.tangential_force_error),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialNumbers:
    """The model's numbers of one trial, or of one stroke without a plan; None where `reasons` says why, by name."""

    trial: Annotated[int | None, Meaning("", "number of the trial")]
    stroke: Annotated[int | None, Meaning("", "position of the stroke it was made for, from 0")]
    block: Annotated[str | None, Meaning("", "name of the trial's block")]
    stimulus: Stimulus | None
    mu: Annotated[Number, Meaning("", "coefficient of friction the model was given")]
    mu_rule: Annotated[str, Meaning("", "which T/N that is")]
    tau_max: Annotated[Number, Meaning("MPa", "traction bound the model was given")]
    indentation: Annotated[Number, Meaning("mm", "of the model's finger")]
    direction: Annotated[int | None, Meaning("", "+1 proximal to distal, -1 back")]
    speed: Annotated[Number, Meaning("mm/s", "of the slide")]
    sed: Annotated[Number, Meaning("MPa", "strain-energy density averaged over the ending (mJ/mm3)")] = None
    error_estimate: Annotated[Number, Meaning("", "relative, of sed")] = None
    normal_per_mm: Annotated[Number, Meaning("N/mm", "the model's normal force")] = None
    tangential_per_mm: Annotated[Number, Meaning("N/mm", "the model's tangential force")] = None
    normal_force: Annotated[Number, Meaning("N", "the same times the finger's width")] = None
    tangential_force: Annotated[Number, Meaning("N", "the same times the finger's width")] = None
    measured_normal: Annotated[Number, Meaning("N", "mean over the steady window")]
    measured_tangential: Annotated[Number, Meaning("N", "mean over the steady window")]
    matching_depth: Annotated[Number, Meaning("mm", "indentation at which the model presses as was measured")] = None
    opposite_sed: Annotated[Number, Meaning("MPa", "slid the other way")] = None
    wall_s: Annotated[Number, Meaning("s", "time the solve took")] = None
    reasons: Annotated[Mapping[str, str], Meaning("", "for each number left out, why")] = field(
        default_factory=dict[str, str]
    )
    alternatives: tuple[Alternative, ...] = ()  # the same trial in other variants, where requested
    interval: SedInterval | None = None  # of `sed`, where requested
    opposite_interval: SedInterval | None = None  # of `opposite_sed`
    # Estimated by the solver, relative [-]: None without such a number, or without an estimate
    normal_force_error: float | None = None
    tangential_force_error: float | None = None
    opposite_error: float | None = None
    matching_depth_error: float | None = None
    matching_depth_interval: Ends | None = None  # from the uncertainty of friction and the measured force [mm]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TrialPrediction(TrialNumbers):
    """The numbers of one trial with the solver's results."""

    prediction: Prediction | None = None  # the solver's result
    opposite: Prediction | None = None  # the same for the opposite slide

    @property
    def responses(self) -> Mapping[str, Response]:
        """Return every quantity at the ending by its name; empty without a prediction."""
        return {} if self.prediction is None else self.prediction.responses

    @property
    def history(self) -> History | None:
        """Return the time course, where requested."""
        return None if self.prediction is None else self.prediction.history

    def picture(self) -> tuple[Fields, Skin] | None:
        """Return the deformed finger with its SED, and the skin's pressures; None without a prediction."""
        return None if self.prediction is None else (fields_of(self.prediction), self.prediction.skin)

    def to_dict(self) -> dict[str, Any]:
        """Return the row as plain data."""
        row: dict[str, Any] = {column.name: getattr(self, column.name) for column in fields(TrialNumbers)}
        row |= {name: asdict(row[name]) for name in _PARTS if row[name] is not None}
        row["reasons"] = dict(self.reasons)
        row["alternatives"] = [asdict(alternative) for alternative in self.alternatives]
        row["solver"] = None if self.prediction is None else self.prediction.to_dict()
        return {name: value for name, value in row.items() if value is not None or name not in _OPTIONAL}


@dataclass(frozen=True, slots=True, eq=False)
class SessionPrediction:
    """The model's predictions for a session."""

    analysis: Analysis  # of the strokes with the friction that the model used
    trials: tuple[TrialPrediction, ...]
    width: float  # of the finger [mm]
    width_origin: str  # "set" or "assumed"
    options: PredictionOptions

    @property
    def finger(self) -> Scene:
        """The finger used, at the chosen strain; its friction and loading are placeholders."""
        finger = template(self.options)
        return replace(finger, solve=replace(finger.solve, kinematics=self.options.kinematics))

    def to_dict(self) -> dict[str, Any]:
        """Return the predictions as plain data, None for withheld numbers."""
        options, settings = asdict(self.options), self.analysis.settings
        default = asdict(PredictionOptions())
        origin = {name: "default" if value == default[name] else "set" for name, value in options.items()}
        return {
            **({"simulated": "SIMULATED"} if self.analysis.simulated else {}),
            "trials": [trial.to_dict() for trial in self.trials],
            "decisions": [decision.to_dict() for decision in self.analysis.decisions],
            "area": asdict(settings.area),
            "gain_error": settings.gain_error,
            "bootstrap_seed": settings.bootstrap_seed,
            "width": self.width,
            "width_origin": self.width_origin,
            "options": _with_former_names(options),
            "options_origin": _with_former_names(origin),
            "scene": asdict(template(self.options)),  # finger, materials and settings as used, with defaults
        }


class _Solver(msgspec.Struct):
    dofs: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _StoredTrial(TrialNumbers):
    solver: _Solver | None


class _Document(msgspec.Struct):
    """The parts of `prediction.json` that the program reads."""

    made_by: dict[str, str]
    trials: tuple[_StoredTrial, ...]
    width: float
    width_origin: str
    options: dict[str, Any]
    scene: dict[str, Any]
    area: dict[str, Any]
    decisions: tuple[Decision, ...]


def _with_former_names(options: Mapping[str, Any]) -> dict[str, Any]:
    return {**options, **{former: options[name] for former, name in _PRESENT_NAMES.items()}}


def with_present_names(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a prediction whose options have only their present names."""
    names = {
        name: {_PRESENT_NAMES.get(key, key): value for key, value in cast("dict[str, Any]", table).items()}
        for name in ("options", "options_origin")
        if isinstance(table := document.get(name), dict)
    }
    return {**document, **names}


def check_prediction(document: Mapping[str, Any]) -> None:
    """Raise ValueError, with place and expected value, where a document is not a prediction of this program."""
    parts = complete(document, _Document)
    from_table(parts.options, PredictionOptions, "options")
    from_table(parts.scene, Scene, "scene")


_SCENE = {"finger": "mm, degrees", "materials": "E in MPa", "receptor": "mm"}  # shared by all trials, with units
_READINGS = {
    "computed": "greatest tangential force over the contact area",
    "as-printed": "a hundredth of that, as the paper's tables are headed",
}
UNKNOWNS = "unknowns"  # name of the fact about the mesh
_AUDITS = {  # 0 is perfect, except for the volume ratio
    "equilibrium_x": "imbalance of forces along the surface, as a share of the contact force",
    "equilibrium_y": "imbalance of forces across the surface, as a share of the contact force",
    "inner_forces": "largest unbalanced force inside the tissue, as a share of the contact force",
    "work_balance": "difference of the work of the contact forces and the stored energy, relative",
    "penetration": "penetration of the skin, as a share of the indentation",
    "tension": "largest tension at a touching node, as a share of the largest pressure",
    "cone_violation": "friction above its law, as a share of the largest nodal force",
    "normal_force_missed": "deviation from the given normal force, relative",
    "drag_missed": "deviation from the given drag, as a share of the friction limit",
    "smallest_det_F": "smallest volume ratio",
    "course_work_balance": "over the course, imbalance of work, stored and lost energy, as a share of the work",
    "course_step_work": "over the course, work of nodes that touch or release in a step, as a share of the bone's work",
    "course_least_dissipation": "least dissipation of friction in a step of the course, as a share of the bone's work",
}


def model_facts(prediction: SessionPrediction | None) -> tuple[tuple[str, str, str], ...]:
    """Return name, value and remark of each fact about the model; audits are the worst over all trials."""
    rows = () if prediction is None else prediction.trials
    predictions = [row.prediction for row in rows if row.prediction is not None]
    if prediction is None or not predictions:
        return ()
    first = predictions[0]
    facts = [(name, str(value), "") for name, value in first.model.items() if name != "left_out"]
    facts += [(name, _values(asdict(getattr(first.scene, name))), units) for name, units in _SCENE.items()]
    facts.append(("finger's width", f"{prediction.width:g} mm", prediction.width_origin))
    facts.append(("τ max", _READINGS[prediction.options.tau_reading], ""))
    facts.append((UNKNOWNS, f"{first.dofs} displacements", "one mesh for all trials"))
    all_audits = [answer.audits for answer in predictions]
    audits = "; ".join(
        f"{_AUDITS.get(name, name.replace('_', ' '))}: {_worst(name, all_audits):.2g}" for name in first.audits
    )
    return (*facts, ("audits", audits, "the worst over all trials; 0 is perfect, 1 for the volume ratio"))


def _worst(audit: str, all_audits: Sequence[Mapping[str, float]]) -> float:
    """Return the least value of an audit named least or smallest, else the greatest."""
    values = [audits[audit] for audits in all_audits if audit in audits]
    return (min(values) if "least" in audit or "smallest" in audit else max(values, key=abs)) + 0.0  # no minus zero


def _values(table: Mapping[str, Any]) -> str:
    """Return a scene's table in words, mm, degrees and MPa as in a scene file; unset values are left out.

    >>> _values({"E": 0.08, "law": None, "prony": ({"g": 0.2, "tau": 0.07},)})
    'E 0.08; prony (g 0.2, tau 0.07)'
    """
    items = ((name.replace("_", " "), value) for name, value in table.items() if value not in (None, ()))
    return "; ".join(f"{name} {_value(value)}" for name, value in items)


def _value(value: Any) -> str:  # noqa: ANN401  any value of a scene file
    if isinstance(value, Mapping):
        items = cast("Mapping[str, Any]", value).items()
        return ", ".join(f"{name} {_value(item)}" for name, item in items if item not in (None, ()))
    if isinstance(value, tuple):
        return "(" + ", ".join(_value(item) for item in cast("tuple[Any, ...]", value)) + ")"
    return value if isinstance(value, str) else f"{value:g}"
