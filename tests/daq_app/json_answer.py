"""The JSON answer that a verb printed, for tests."""

import json


def answer(capsys):
    return json.loads(capsys.readouterr().out)
