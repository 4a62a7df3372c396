"""Is a session what it was: every checksum, and every number made from it made once more."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

MADE_BY = "made_by"  # versions of what made a stored document
TIMINGS = frozenset(
    {"wall_s", "setup_s", "estimate_s", "evidence_s", MADE_BY, "SIMULATED"}
)  # not numbers of the session
_MOST = 20  # differences named one by one


def differences(stored: object, fresh: object, where: str) -> Iterator[str]:
    """Yield a sentence for each value that was stored otherwise than it comes out now; timings are left out.

    >>> list(differences({"a": [1.0, 2.0], "wall_s": 3}, {"a": [1.0, 2.5], "wall_s": 4}, "x"))
    ['x.a[1] was stored as 2.0 and comes out as 2.5 (+25 %)']
    """
    if isinstance(stored, Mapping) and isinstance(fresh, Mapping):
        then, now = cast("Mapping[str, Any]", stored), cast("Mapping[str, Any]", fresh)
        for key in sorted({*then, *now} - TIMINGS, key=_rank):
            if key not in then or key not in now:
                yield f"{where}.{key} is {'new' if key in now else 'no longer made'}"
            else:
                yield from differences(then[key], now[key], f"{where}.{key}")
    elif isinstance(stored, list | tuple) and isinstance(fresh, list | tuple):
        before, after = cast("Sequence[Any]", stored), cast("Sequence[Any]", fresh)
        if len(before) != len(after):
            yield f"{where} was stored with {len(before)} entries and comes out with {len(after)}"
        else:
            for i, (a, b) in enumerate(zip(before, after, strict=True)):
                yield from differences(a, b, f"{where}[{i}]")
    elif stored != fresh or isinstance(stored, bool) != isinstance(fresh, bool):
        yield f"{where} was stored as {stored!r} and comes out as {fresh!r}{_by(cast('object', stored), fresh)}"


def _rank(key: str) -> tuple[int, str]:
    """Return where a name stands among the differences: what others come from first, what comes of others last."""
    return (0 if key in ("settings", "options", "decisions") else 2 if key == "bootstrap" else 1), key


def _by(stored: object, fresh: object) -> str:
    """Say how much a number changed, where that can be said."""
    if not isinstance(stored, float) or not isinstance(fresh, float) or stored == 0.0:
        return ""
    return f" ({100.0 * (fresh / stored - 1.0):+.3g} %)"


def why(name: str, stored: Mapping[str, Any], now: Mapping[str, str]) -> str:
    """Say of a document whose numbers come out otherwise what changed since it was made.

    >>> why("a.json", {"made_by": {"numpy": "1", "scipy": "2"}}, {"numpy": "1", "scipy": "3"})
    'a.json was made by other versions: scipy 2 then and 3 now'
    """
    software: Any = stored.get(MADE_BY)
    then: Mapping[str, Any] = cast("Mapping[str, Any]", software) if isinstance(software, Mapping) else {}
    if not then:
        return f"{name} does not say what made it"
    changed = [
        f"{library} {then.get(library, 'absent')} then and {now.get(library, 'absent')} now"
        for library in {**then, **now}
        if then.get(library) != now.get(library)
    ]
    if not changed:
        return (
            f"{name} was made by the same versions as now: the document, the recording or the program was changed since"
        )
    return f"{name} was made by other versions: {', '.join(changed)}"


def first_sentences(sentences: Sequence[str]) -> tuple[str, ...]:
    """Return the first of many sentences, and how many more there are."""
    more = len(sentences) - _MOST
    return tuple(sentences) if more <= 0 else (*sentences[:_MOST], f"and {more} more numbers differ")
