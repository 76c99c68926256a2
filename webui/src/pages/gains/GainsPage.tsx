import { useEffect, useState } from 'react'
import { href } from '../../app/navigation/router'
import { useT } from '../../i18n'
import * as live from '../../live/live'
import { useDrive, useLink } from '../../live/store'
import { Panel } from '../../widgets/layout/Panel'
import { ParameterFields } from '../../widgets/parameters/ParameterFields'
import { ProfileText } from '../../widgets/profile-text/ProfileText'
import { useRows } from '../../widgets/profile-text/rows'
import { useFunctions } from '../../widgets/drive/useFunctions'
import { remember } from '../response/design/undo'
import { UndoNote } from '../response/design/UndoNote'
import { grouped } from './blocks'
import { LoopPicture } from './LoopPicture'

/** Every gain, filter and switch of the loops, at the place where it acts. */
export function GainsPage({ drive }: { drive: string }) {
  const t = useT()
  const { open } = useLink()
  const rows = useRows(drive)
  const summary = useDrive(drive)
  const functions = useFunctions(drive)
  const [again, setAgain] = useState(0)
  useEffect(() => {
    if (open && rows === null) void live.loadRows(drive).catch(() => {})
  }, [drive, open, rows])
  const reachable = new Set((rows ?? []).filter((row) => row.reachable).map((row) => row.key))
  const blocks = grouped(functions?.gain_blocks ?? [], reachable)
  const named = new Set(functions?.gain_blocks.flatMap((block) => block.keys))
  const elsewhere = (rows ?? []).filter((row) => !row.reachable && named.has(row.key)).length
  const show = (block: string) => {
    const panel = document.getElementById(`block-${block}`)
    panel?.scrollIntoView({ block: 'start' })
    panel?.querySelector<HTMLElement>('h2')?.focus()
  }
  return (
    <div className="page">
      <h1>
        {t('page.gains')} <small className="dim">{summary?.name}</small>
      </h1>
      <p className="prose">
        {t('gains.pageHelp')} <a href={href('tune', drive)}>{t('gains.toTune')}</a>
      </p>
      <UndoNote drive={drive} onUndone={() => setAgain(again + 1)} />
      {elsewhere > 0 && (
        <p className="note warn">
          {t('gains.otherPort', { count: elsewhere })}{' '}
          <a href={href('connect', drive)}>{t('page.connect')}</a>
        </p>
      )}
      {functions && rows && blocks.length === 0 && <p className="empty">{t('gains.none')}</p>}
      {blocks.length > 0 && (
        <Panel title={t('gains.picture')}>
          <LoopPicture present={new Set(blocks.map((each) => each.block))} onBlock={show} />
        </Panel>
      )}
      <div className="columns" key={again}>
        {blocks.map(({ block, parts }) => (
          <section key={block} id={`block-${block}`} className="gain-block">
            <Panel title={<span>{t(`block.${block}`)}</span>}>
              <p className="dim">{t(`blockHelp.${block}`)}</p>
              {parts.map((part) => (
                <div key={part.keys.join(' ')}>
                  {part.set_number != null && (
                    <h3>{t('gains.set', { number: part.set_number })}</h3>
                  )}
                  {part.help && (
                    <p className="dim">
                      <ProfileText drive={drive} text={part.help} />
                    </p>
                  )}
                  <ParameterFields
                    drive={drive}
                    keys={part.keys}
                    onWritten={(before, after) => remember(drive, 'gains', { before, after })}
                  />
                </div>
              ))}
              {block === 'notch' && <a href={href('response', drive)}>{t('page.response')}</a>}
            </Panel>
          </section>
        ))}
      </div>
    </div>
  )
}
