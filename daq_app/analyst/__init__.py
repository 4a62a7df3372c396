"""The analyst's place without Qt: what is known of a session folder, what is shown of it, and the work behind it.

`messages` go between window and work; `state` folds them; `session_words` and `finger_words` say what is shown; `work`
does it in the process that `process` starts.
"""
