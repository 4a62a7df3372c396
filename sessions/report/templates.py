"""The templates of pages: what is written into them is escaped, and a name nobody gave is an error."""

from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape


def template(name: str) -> Template:
    """Return the template in a file of this folder."""
    environment = Environment(
        loader=PackageLoader("sessions.report", "."),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(name)
