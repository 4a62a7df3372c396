"""Orders and labels of stimuli: reproducible from a seed, in any language, for as long as there is SHA-256."""

import hashlib
from collections.abc import Sequence

LETTERS = "BCDFGHJKLMNPQRSTVWXZ"  # no vowels: no label spells a word


def shuffled(items: Sequence[int], seed: int, name: str) -> tuple[int, ...]:
    """Return the items in an order that chance, seeded with `seed` and `name`, put them in.

    The rule: sort by the SHA-256 digest of the UTF-8 text "seed/name/item", each a decimal number or the name itself.
    Every order is equally likely over seeds. Items must differ.

    >>> shuffled((0, 20, 50, 80, 100), 1, "stickiness")
    (80, 100, 20, 50, 0)
    """
    return tuple(sorted(items, key=lambda item: _digest(f"{seed}/{name}/{item}")))


def opaque_codes(count: int, seed: int) -> tuple[str, ...]:
    """Return `count` different labels of a letter and two digits, which tell nothing about what they stand on.

    The rule: from the SHA-256 digests of "seed/label/0", "seed/label/1", ... as whole numbers, the letter is the
    remainder by 20 and the digits the remainder by 100 of the quotient; labels that came before are left out.
    Raises ValueError for more than 2000 labels.

    >>> opaque_codes(3, 1)
    ('X87', 'D86', 'K50')
    """
    if count > len(LETTERS) * 100:
        raise ValueError(f"{count} labels were asked for; a letter and two digits give at most {len(LETTERS) * 100}")
    codes: dict[str, None] = {}
    attempt = 0
    while len(codes) < count:
        number = int.from_bytes(_digest(f"{seed}/label/{attempt}"), "big")
        rest, letter = divmod(number, len(LETTERS))
        codes[f"{LETTERS[letter]}{rest % 100:02d}"] = None
        attempt += 1
    return tuple(codes)


def _digest(text: str) -> bytes:
    """Return the SHA-256 digest of a text."""
    return hashlib.sha256(text.encode()).digest()
