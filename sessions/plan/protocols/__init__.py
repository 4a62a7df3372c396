"""The protocols we run, a validated TOML file each, their reader, and the plan of a session. The folder is the list."""

from sessions.plan.protocols.planning import (
    CODE_RULE,
    Body,
    StudyPlace,
    VisitSetting,
    blind,
    design_rows,
    is_code,
    plan,
)
from sessions.plan.protocols.protocol import (
    BlockOutline,
    Face,
    Labels,
    Protocol,
    protocol,
    protocol_file,
    protocol_names,
)

__all__ = [
    "CODE_RULE",
    "BlockOutline",
    "Body",
    "Face",
    "Labels",
    "Protocol",
    "StudyPlace",
    "VisitSetting",
    "blind",
    "design_rows",
    "is_code",
    "plan",
    "protocol",
    "protocol_file",
    "protocol_names",
]
