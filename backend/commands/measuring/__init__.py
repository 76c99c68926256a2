"""Commands that measure: tools, autotune, health, report, responses from recordings."""
