audit_line-no-entry-audit = line { $number } is no entry of an audit
    .remedy = export it with --format jsonl, without a filter
