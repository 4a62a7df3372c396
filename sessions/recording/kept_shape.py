"""What `analysis.json` and `prediction.json` must hold so that what reads them finds what it looks for.

The kinds of their rows are those of the types that wrote them. Whoever changed a file by hand, or half a copy, is told
where it is no longer one of ours.
"""

from collections.abc import Mapping
from functools import cache
from types import GenericAlias
from typing import Any, get_type_hints

import msgspec

from sessions.plan.plan import Stimulus
from sessions.prediction import PredictionOptions, Scene, TrialPrediction
from sessions.prediction.sed_interval import SedInterval
from sessions.prediction.variants import Alternative, Variant
from sessions.strokes import FrictionParameters, Stroke
from sessions.strokes.bootstrap import BootstrapSettings, StrokeIntervals
from sessions.strokes.decisions import Decision
from sessions.strokes.flaws import Flaw
from sessions.toml_file import SettingsError, from_table


def check_analysis(document: Mapping[str, Any]) -> None:
    """Raise SettingsError where a document is no analysis that this program writes: where, and what is expected."""
    held: dict[str, Any] = _converted(document, _analysis())
    if len(held["bootstrap"].strokes) != len(held["strokes"]):
        raise SettingsError("it has intervals of another number of strokes")
    beyond = [row.stroke for row in held["friction"] if not 0 <= row.stroke < len(held["strokes"])]
    if beyond:
        raise SettingsError(f"it tells the friction of stroke {beyond[0]}, which it does not hold")
    from_table(held["bootstrap"].settings, BootstrapSettings, "bootstrap")


def check_prediction(document: Mapping[str, Any]) -> None:
    """Raise SettingsError where a document is no prediction that this program writes: where, and what is expected."""
    held: dict[str, Any] = _converted(document, _prediction())
    from_table(held["options"], PredictionOptions, "options")
    from_table(held["scene"], Scene, "scene")


def _converted(document: Mapping[str, Any], form: type[msgspec.Struct]) -> dict[str, Any]:
    try:
        return msgspec.structs.asdict(msgspec.convert(document, form))
    except msgspec.ValidationError as wrong:
        raise SettingsError(str(wrong).replace("`$.", "`")) from wrong


@cache
def _analysis() -> type[msgspec.Struct]:
    intervals = _form(
        "Intervals",
        kind=str,
        settings=dict[str, Any],
        strokes=_several(_row(StrokeIntervals)),
    )
    return _form(
        "Analysis",
        made_by=dict[str, str],
        strokes=_several(_row(Stroke, leave=("curve",))),
        friction=_several(_row(FrictionParameters)),
        flaws=_several(_row(Flaw)),
        interval=str,
        decisions=_several(_row(Decision, leave=("undoes",))),
        bootstrap=intervals,
    )


@cache
def _prediction() -> type[msgspec.Struct]:
    interval = _or_none(_row(SedInterval))
    row = _row(
        TrialPrediction,
        leave=("prediction", "opposite"),
        may_lack=("interval", "opposite_interval"),
        stimulus=_or_none(_row(Stimulus)),
        alternatives=_several(_row(Alternative, variant=_row(Variant), interval=interval)),
        interval=interval,
        opposite_interval=interval,
        solver=_or_none(_form("Solver", dofs=int)),
    )
    return _form(
        "Prediction",
        made_by=dict[str, str],
        trials=_several(row),
        width=float,
        width_origin=str,
        options=dict[str, Any],
        scene=dict[str, Any],
        area=dict[str, Any],
        decisions=_several(_row(Decision, leave=("undoes",))),
    )


def _form(name: str, **parts: Any) -> type[msgspec.Struct]:  # noqa: ANN401  types, or unions of them
    return msgspec.defstruct(name, list(parts.items()))


def _several(form: object) -> Any:  # noqa: ANN401
    return GenericAlias(tuple, (form, ...))


def _or_none(form: type[msgspec.Struct]) -> Any:  # noqa: ANN401
    return form | None


def _row(
    of: type,
    leave: tuple[str, ...] = (),
    may_lack: tuple[str, ...] = (),
    **instead: Any,  # noqa: ANN401
) -> type[msgspec.Struct]:
    """Return the form of a row that is written from a dataclass, some of its parts otherwise than they are there."""
    kinds = {name: kind for name, kind in get_type_hints(of).items() if name not in leave} | instead
    parts: list[Any] = [(name, kind, None) if name in may_lack else (name, kind) for name, kind in kinds.items()]
    return msgspec.defstruct(of.__name__, parts, kw_only=True)
