"""What a verb told to answer in JSON printed, for tests."""

import json


def answer(capsys):
    return json.loads(capsys.readouterr().out)
