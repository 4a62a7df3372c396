"""Sentences as they stand alone in the window."""


def sentence(text: str) -> str:
    """Return a text with a capital and a full stop; what begins with a name of a file or address keeps it as it is.

    >>> sentence("there is no driver 'x'"), sentence("a.toml: no such file"), sentence("sim: has no rate 9")
    ("There is no driver 'x'.", 'a.toml: no such file.', 'sim: has no rate 9.')
    """
    text = " ".join(text.split())
    if text.split(" ", 1)[0].isalpha():
        text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) else f"{text}."
