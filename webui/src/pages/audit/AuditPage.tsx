import { Button, NativeSelect, TextInput } from '@mantine/core'
import { useState } from 'react'
import { API_ROOT } from '../../api/client'
import type { AuditNames } from '../../api/schema'
import { known, useSay, useT } from '../../i18n'
import { Icon } from '../../widgets/layout/Icon'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { AuditTable } from './AuditTable'
import './audit.css'
import { ChainCheck } from './ChainCheck'
import { ALL, type AuditFilters, type AuditKind, auditQuery } from './filters'
import { useAudit } from './useAudit'

/** Who did what, when, to which axis. */
export function AuditPage() {
  const t = useT()
  const say = useSay()
  const [filters, setFilters] = useState<AuditFilters>(ALL)
  const { events, names, status, problem, refresh, older } = useAudit(filters)
  return (
    <div className="page">
      <h1>{t('page.audit')}</h1>
      {status?.problem && (
        <div className="note fault" role="alert">
          <p>{t('audit.problem', { count: status.pending })}</p>
          <p>{say.message(status.problem_message, status.problem)}</p>
        </div>
      )}
      <Panel
        title={t('audit.title')}
        tools={
          <>
            <Button onClick={refresh}>{t('audit.refresh')}</Button>
            {(['csv', 'jsonl'] as const).map((format) => (
              <Button
                key={format}
                component="a"
                href={exportUrl(filters, format)}
                download
                leftSection={<Icon name="download" />}
                aria-label={t('audit.export', { format: format.toUpperCase() })}
              >
                {format.toUpperCase()}
              </Button>
            ))}
          </>
        }
      >
        <p className="dim">{t('audit.help')}</p>
        <Choices filters={filters} names={names} onChange={setFilters} />
        <ProblemNote problem={problem} />
        {events?.length === 0 && (
          <p className="empty">
            {t(Object.values(filters).some(Boolean) ? 'audit.none' : 'audit.empty')}
          </p>
        )}
        {events && events.length > 0 && <AuditTable events={events} />}
        {older && (
          <div className="row end">
            <Button onClick={older}>{t('audit.more')}</Button>
          </div>
        )}
      </Panel>
      <ChainCheck />
    </div>
  )
}

function exportUrl(filters: AuditFilters, format: 'csv' | 'jsonl'): string {
  const query = new URLSearchParams({ format })
  for (const [name, value] of Object.entries(auditQuery(filters))) {
    if (Array.isArray(value)) for (const each of value) query.append(name, each)
    else if (value) query.append(name, value)
  }
  return `${API_ROOT}/api/v1/audit/export?${query}`
}

function Choices({
  filters,
  names,
  onChange,
}: {
  filters: AuditFilters
  names: AuditNames | null
  onChange: (filters: AuditFilters) => void
}) {
  const t = useT()
  const put = (change: Partial<AuditFilters>) => onChange({ ...filters, ...change })
  const any = { value: '', label: t('audit.any') }
  return (
    <div className="audit-filters">
      <TextInput
        type="search"
        label={t('library.search')}
        value={filters.words}
        maxLength={200}
        onChange={(event) => put({ words: event.currentTarget.value })}
      />
      <NativeSelect
        label={t('audit.kind')}
        value={filters.kind}
        onChange={(event) => put({ kind: event.currentTarget.value as AuditKind | '' })}
        data={[
          { value: '', label: t('audit.kind.all') },
          ...(names?.kinds ?? []).map((kind) => ({
            value: kind,
            label: known(t, 'audit.kind', kind),
          })),
        ]}
      />
      <NativeSelect
        label={t('audit.person')}
        value={filters.person}
        onChange={(event) => put({ person: event.currentTarget.value })}
        data={[any, ...(names?.persons ?? [])]}
      />
      <NativeSelect
        label={t('audit.axis')}
        value={filters.axis}
        onChange={(event) => put({ axis: event.currentTarget.value })}
        data={[any, ...(names?.axes ?? [])]}
      />
      <TextInput
        type="date"
        label={t('library.since')}
        value={filters.since}
        onChange={(event) => put({ since: event.currentTarget.value })}
      />
      <TextInput
        type="date"
        label={t('library.until')}
        value={filters.until}
        onChange={(event) => put({ until: event.currentTarget.value })}
      />
    </div>
  )
}
