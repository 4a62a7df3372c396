"""Generated tables in pages of the docs, each between its marks."""


def fill_marks(text: str, name: str, text_between: str) -> str:
    r"""Return the page with the table between its marks replaced. Raises ValueError where the marks are missing.

    >>> fill_marks("a <!-- x: begin -->old<!-- x: end --> b", "x", "new")
    'a <!-- x: begin -->\nnew\n<!-- x: end --> b'
    """
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    head, _, after = text.partition(begin)
    _, mark, tail = after.partition(end)
    if not mark:
        raise ValueError(f"The page has no marks for {name}.")
    return f"{head}{begin}\n{text_between}\n{end}{tail}"
