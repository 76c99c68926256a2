import { Button, FileButton } from '@mantine/core'
import { useState } from 'react'
import { API_ROOT, api, ask } from '../../api/client'
import type { MeasurementInfo, Problem } from '../../api/schema'
import { known, useSay, useT } from '../../i18n'
import { ConfirmDelete } from '../../widgets/messages/ConfirmDelete'
import { dateTime } from '../../widgets/numbers/format'
import { Icon } from '../../widgets/layout/Icon'
import { Panel } from '../../widgets/layout/Panel'
import { ProblemNote } from '../../widgets/messages/ProblemNote'
import { useAction } from '../../widgets/requests/useAction'
import { comparable } from './useMeasurements'

/** Stored responses: show one, lay another over it, take in, hand out, delete. */
export function MeasurementList({
  list,
  problem,
  shown,
  over,
  onShow,
  onOver,
  onChange,
}: {
  list: MeasurementInfo[]
  problem: Problem | null
  shown: string | null
  over: string | null
  onShow: (file: string) => void
  onOver: (file: string | null) => void
  onChange: () => Promise<void>
}) {
  const t = useT()
  const say = useSay()
  const act = useAction()
  const kind = list.find((each) => each.file === shown)?.kind
  const [doomed, setDoomed] = useState<string | null>(null)
  const upload = (file: File) =>
    act.run(async () => {
      const answer = await ask(
        api.POST('/api/v1/measurements', {
          params: { query: { name: file.name } },
          body: file as never,
          bodySerializer: (body: unknown) => body as BodyInit,
          headers: { 'Content-Type': 'application/octet-stream' },
        }),
      )
      await onChange()
      onShow(answer.file)
    })
  const remove = (file: string) =>
    act.run(async () => {
      await ask(api.DELETE('/api/v1/measurements/{name}', { params: { path: { name: file } } }))
      await onChange()
    })
  return (
    <Panel
      title={t('measured.title')}
      tools={
        <FileButton accept=".sdmeas" onChange={(file) => file && void upload(file)}>
          {(props) => (
            <Button {...props} loading={act.busy} leftSection={<Icon name="upload" />}>
              {t('measured.upload')}
            </Button>
          )}
        </FileButton>
      }
    >
      {list.length === 0 && <p className="dim">{t('measured.none')}</p>}
      <ul className="plain-list scroll-list tall">
        {list.map((each) => (
          <li key={each.file} className="set measured">
            <span className="grow">
              <strong>
                {each.problem === ''
                  ? known(t, 'measured', each.kind)
                  : t('measured.unusable', {
                      problem: say.message(each.problem_message, each.problem),
                    })}
              </strong>
              <small className="dim num">
                {' '}
                {each.drive} · {dateTime(each.saved)}
              </small>
            </span>
            {each.problem === '' && (
              <>
                <Button
                  aria-pressed={shown === each.file}
                  variant={shown === each.file ? 'filled' : 'default'}
                  onClick={() => onShow(each.file)}
                >
                  {t('measured.show')}
                </Button>
                <Button
                  aria-pressed={over === each.file}
                  variant={over === each.file ? 'filled' : 'default'}
                  disabled={shown === null || shown === each.file || !comparable(kind, each.kind)}
                  title={
                    shown !== null && !comparable(kind, each.kind)
                      ? t('measured.otherKind')
                      : undefined
                  }
                  onClick={() => onOver(over === each.file ? null : each.file)}
                >
                  {t('measured.compare')}
                </Button>
                <a
                  className="icon-link"
                  href={`${API_ROOT}/api/v1/measurements/${encodeURIComponent(each.file)}/file`}
                  aria-label={t('measured.download', { file: each.file })}
                  download={each.file}
                >
                  <Icon name="download" />
                </a>
              </>
            )}
            <Button
              aria-label={t('measured.delete', { file: each.file })}
              onClick={() => setDoomed(each.file)}
            >
              <Icon name="cross" />
            </Button>
          </li>
        ))}
      </ul>
      <ProblemNote problem={problem ?? act.problem} onClose={act.clear} />
      {doomed !== null && (
        <ConfirmDelete
          title={t('measured.deleteTitle')}
          action={t('measured.deleteNow')}
          onClose={() => setDoomed(null)}
          onDelete={() => {
            setDoomed(null)
            void remove(doomed)
          }}
        >
          <p className="mono">{doomed}</p>
          <p>{t('measured.deleteText')}</p>
        </ConfirmDelete>
      )}
    </Panel>
  )
}
