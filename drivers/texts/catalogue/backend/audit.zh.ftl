audit_line-no-entry-audit = 第 { $number } 行不是审计记录
    .remedy = 请用 --format jsonl 且不带筛选导出
