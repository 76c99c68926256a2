audit_line-no-entry-audit = line { $number } is not an entry of an audit
    .remedy = export it with --format jsonl, without a filter
audit_another-value-kept = the drive keeps { $kept } instead of { $wanted }
audit_events-lost = { $count ->
    [one] { $count } event
   *[other] { $count } events
    } could not be stored
audit_hash-not-of-anchor = its hash differs from that of the anchor, { $anchor }: the history was rewritten
audit_head-gone = the head of the chain is missing
audit_end-missing = the chain ended with entry { $ended }; the last one present is { $last }
audit_anchor-beyond-end = the anchor names entry { $anchor }; the last one present is { $last }
audit_entry-missing = entry { $number } is missing
audit_entry-does-not-follow = it does not follow the entry before it
audit_contents-altered = its contents were altered after writing
audit_contents-unreadable = its contents are unreadable
audit_column-altered = its column { $column } does not match its contents
