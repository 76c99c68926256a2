"""The audit trail: who did what to which axis, in a hash chain that reveals any later change."""

from backend.records.audit.facts import Fact
from backend.records.audit.log import AuditLog

__all__ = ["AuditLog", "Fact"]
