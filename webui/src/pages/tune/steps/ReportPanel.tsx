import { Button, NativeSelect, SegmentedControl, Textarea, TextInput } from '@mantine/core'
import { useCallback, useEffect, useState } from 'react'
import { API_ROOT, api, ask, problemOf } from '../../../api/client'
import type { Problem, ReportInfo, ReportRequest } from '../../../api/schema'
import { useLanguage, useT } from '../../../i18n'
import { useDrive } from '../../../live/store'
import { ConfirmDelete } from '../../../widgets/messages/ConfirmDelete'
import { dateTime } from '../../../widgets/numbers/format'
import { Icon } from '../../../widgets/layout/Icon'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { ProcedureButton } from '../../../widgets/faults/Procedures'
import { useAction } from '../../../widgets/requests/useAction'

const FORMATS = ['pdf', 'html'] as const
const LANGUAGES = ['en', 'zh'] as const

/** Stored reports, newest first. */
export function useReports() {
  const [list, setList] = useState<ReportInfo[]>([])
  const [problem, setProblem] = useState<Problem | null>(null)
  const [asked, setAsked] = useState(false)
  const refresh = useCallback(async () => {
    try {
      setList(await ask(api.GET('/api/v1/reports')))
      setProblem(null)
    } catch (error) {
      setProblem(problemOf(error))
    }
    setAsked(true)
  }, [])
  useEffect(() => {
    void refresh()
  }, [refresh])
  return { list, problem, refresh, asked }
}

/** The commissioning report: what was measured and changed, to keep and to sign. */
export function ReportPanel({ drive, of }: { drive: string; of: ReturnType<typeof useReports> }) {
  const t = useT()
  const shown = useLanguage()
  const unsaved = useDrive(drive)?.unsaved ?? 0
  const [format, setFormat] = useState<ReportRequest['format']>('pdf')
  const [language, setLanguage] = useState<ReportRequest['language']>(shown)
  const [person, setPerson] = useRememberedText('report.person')
  const [machine, setMachine] = useRememberedText('report.machine')
  const [notes, setNotes] = useState('')
  const [doomed, setDoomed] = useState<string | null>(null)
  const make = useAction()
  const remove = useAction()
  const go = () =>
    make.run(async () => {
      await ask(
        api.POST('/api/v1/drives/{drive_id}/reports', {
          params: { path: { drive_id: drive } },
          body: { format, language, person, machine, notes },
        }),
      )
      await of.refresh()
    })
  const drop = (file: string) =>
    remove.run(async () => {
      await ask(api.DELETE('/api/v1/reports/{name}', { params: { path: { name: file } } }))
      await of.refresh()
    })
  return (
    <Panel title={t('report.title')}>
      <p className="dim">{t('report.help')}</p>
      <div className="fields wide">
        <TextInput
          label={t('report.machine')}
          value={machine}
          maxLength={200}
          onChange={(event) => setMachine(event.currentTarget.value)}
        />
        <TextInput
          label={t('report.person')}
          value={person}
          maxLength={200}
          onChange={(event) => setPerson(event.currentTarget.value)}
        />
        <NativeSelect
          label={t('report.language')}
          value={language}
          onChange={(event) => setLanguage(event.currentTarget.value as typeof language)}
          data={LANGUAGES.map((each) => ({ value: each, label: t(`language.${each}`) }))}
        />
      </div>
      <Textarea
        label={t('report.notes')}
        value={notes}
        maxLength={8000}
        autosize
        minRows={2}
        onChange={(event) => setNotes(event.currentTarget.value)}
      />
      <SegmentedControl
        value={format ?? 'pdf'}
        onChange={(next) => setFormat(next)}
        data={FORMATS.map((each) => ({ value: each, label: t(`report.${each}`) }))}
        mt={8}
      />
      <div className="row wrap">
        <Button variant="filled" loading={make.busy} onClick={() => void go()}>
          {t('report.make')}
        </Button>
        <ProcedureButton
          drive={drive}
          name="save"
          label={unsaved > 0 ? t('parameters.saveCount', { count: unsaved }) : t('parameters.save')}
        />
      </div>
      <ProblemNote problem={make.problem ?? remove.problem ?? of.problem} onClose={make.clear} />
      <ul className="plain-list scroll-list">
        {of.list.map((each) => (
          <li key={each.file} className="set">
            <a
              className="grow big"
              href={`${API_ROOT}/api/v1/reports/${encodeURIComponent(each.file)}`}
              target="_blank"
              rel="noreferrer"
            >
              {each.file}
            </a>
            <small className="dim num">{dateTime(each.made)}</small>
            <a
              className="icon-link"
              href={`${API_ROOT}/api/v1/reports/${encodeURIComponent(each.file)}`}
              aria-label={t('report.download', { file: each.file })}
              download={each.file}
            >
              <Icon name="download" />
            </a>
            <Button
              aria-label={t('report.delete', { file: each.file })}
              onClick={() => setDoomed(each.file)}
            >
              <Icon name="cross" />
            </Button>
          </li>
        ))}
      </ul>
      {doomed !== null && (
        <ConfirmDelete
          title={t('report.deleteTitle')}
          action={t('measured.deleteNow')}
          onClose={() => setDoomed(null)}
          onDelete={() => {
            setDoomed(null)
            void drop(doomed)
          }}
        >
          <p className="mono">{doomed}</p>
        </ConfirmDelete>
      )}
    </Panel>
  )
}

/** A short text kept in this browser, the same for all axes. */
function useRememberedText(name: string): [string, (text: string) => void] {
  const place = `servodeck.${name}`
  const [text, setText] = useState(() => localStorage.getItem(place) ?? '')
  return [
    text,
    (next) => {
      setText(next)
      localStorage.setItem(place, next)
    },
  ]
}
