api-audit_since-must-before-until = since must be before until
    .remedy = exchange the two
