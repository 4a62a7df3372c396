"""Blinding: a session names codes alone, and which stimulus bears which code lies in a sealed key until it is opened.

It is against peeking, not against an attack: whoever can read the study's folder can undo the sealing on purpose. The
key's SHA-256, with a salt, stands in every plan, so a key that was changed later is found.
"""

import base64
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from sessions.plan.plan import SessionPlan, Trial


@dataclass(frozen=True, slots=True)
class Key:
    """Which stimulus bears which code, throughout a study."""

    salt: str  # hexadecimal, by chance: without it the few possible keys could be tried one by one
    stimuli: Mapping[str, tuple[str, int]]  # code -> descriptor and index

    @property
    def sha256(self) -> str:
        """Return the SHA-256 of the UTF-8 text "salt", then a line "code descriptor index" each, codes sorted."""
        lines = [self.salt, *(f"{code} {of} {index}" for code, (of, index) in sorted(self.stimuli.items()))]
        return hashlib.sha256("\n".join(lines).encode()).hexdigest()

    def sealed(self) -> str:
        """Return the key as a text that tells nothing to whoever opens its file by chance (Base64 of JSON)."""
        return base64.b64encode(json.dumps(self.to_dict()).encode()).decode()

    @staticmethod
    def opened(sealed: str) -> "Key":
        """Return the key that `sealed` gave the text for. Raises ValueError where it is none."""
        return Key.from_dict(json.loads(base64.b64decode(sealed, validate=True)))

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        stimuli = {code: {"descriptor": of, "index": index} for code, (of, index) in sorted(self.stimuli.items())}
        return {"salt": self.salt, "stimuli": stimuli}

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> "Key":
        """Return the key that `to_dict` gave `data` for. Raises ValueError where it is none."""
        try:
            stimuli = {code: (str(of["descriptor"]), int(of["index"])) for code, of in data["stimuli"].items()}
            return Key(str(data["salt"]), stimuli)
        except (KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"this is no key of a study ({error})") from error

    def of(self, trial: Trial) -> Trial:
        """Return a trial with the index of its stimulus. Raises ValueError where the key lacks its code."""
        stimulus = self.stimuli.get(trial.stimulus.code)
        if stimulus is None:
            raise ValueError(f"the key has no stimulus {trial.stimulus.code}")
        return replace(trial, stimulus=replace(trial.stimulus, index=stimulus[1]))

    def plan(self, plan: SessionPlan) -> SessionPlan:
        """Return a blinded plan with the index of every stimulus."""
        return replace(plan, blocks=tuple(replace(b, trials=tuple(map(self.of, b.trials))) for b in plan.blocks))
