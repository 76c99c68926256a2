import { Checkbox, NativeSelect, TextInput } from '@mantine/core'
import type { TagCount } from '../../../api/schema'
import { useT } from '../../../i18n'
import { type Filters, KINDS, type LibraryKind } from './filters'

/** What to show of the library. */
export function LibraryFilters({
  filters,
  tags,
  onChange,
}: {
  filters: Filters
  tags: TagCount[]
  onChange: (filters: Filters) => void
}) {
  const t = useT()
  const put = (change: Partial<Filters>) => onChange({ ...filters, ...change })
  const known = tags.some((each) => each.tag === filters.tag) || filters.tag === ''
  return (
    <div className="library-filters">
      <TextInput
        className="library-words"
        type="search"
        label={t('library.search')}
        placeholder={t('library.searchHelp')}
        value={filters.words}
        maxLength={200}
        onChange={(event) => put({ words: event.currentTarget.value })}
      />
      <NativeSelect
        label={t('library.kind')}
        value={filters.kind}
        onChange={(event) => put({ kind: event.currentTarget.value as LibraryKind | '' })}
        data={[
          { value: '', label: t('library.kind.all') },
          ...KINDS.map((kind) => ({ value: kind, label: t(`library.kind.${kind}`) })),
        ]}
      />
      <NativeSelect
        label={t('library.tag')}
        value={filters.tag}
        onChange={(event) => put({ tag: event.currentTarget.value })}
        data={[
          { value: '', label: t('library.tag.any') },
          ...(known ? [] : [{ value: filters.tag, label: filters.tag }]),
          ...tags.map((each) => ({ value: each.tag, label: `${each.tag} (${each.count})` })),
        ]}
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
      <Checkbox
        label={t('library.undoSets')}
        checked={filters.undo}
        onChange={(event) => put({ undo: event.currentTarget.checked })}
      />
      <Checkbox
        label={t('library.deleted')}
        checked={filters.deleted}
        onChange={(event) => put({ deleted: event.currentTarget.checked })}
      />
    </div>
  )
}
