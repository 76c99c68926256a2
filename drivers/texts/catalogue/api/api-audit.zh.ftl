api-audit_since-must-before-until = since 必须早于 until
    .remedy = 请将两者对调
