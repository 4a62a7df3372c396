"""Numbers made once more: with the settings that they were kept with, not with the present ones."""

from dataclasses import asdict, replace

from closed_form import PLAIN, T, analyse, block, noisy

from daq_app.batch.derived import analysis_document
from sessions.strokes.bootstrap import stroke_intervals


def test_intervals_are_drawn_again_with_the_settings_they_were_kept_with():
    analysis = analyse(block(T, noisy(PLAIN)))
    settings = replace(analysis.bootstrap, repeats=60, seed=3)
    repeated = analysis_document(analysis, settings)["bootstrap"]
    assert repeated["settings"] == asdict(settings)
    assert repeated["strokes"] == [asdict(stroke_intervals(analysis.strokes[0], 0, settings))]
    present = analysis_document(analysis, analysis.bootstrap)["bootstrap"]
    assert present == analysis_document(analysis)["bootstrap"]
    assert present["strokes"] != repeated["strokes"]
