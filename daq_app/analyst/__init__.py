"""The analyst's place without Qt: what is known of a session folder, what is shown of it, and the work behind it."""
