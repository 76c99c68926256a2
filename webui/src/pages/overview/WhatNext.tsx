import { href } from '../../app/navigation/router'
import { useCanTune } from '../../app/navigation/useCanTune'
import { useHasIo } from '../../app/navigation/useHasIo'
import { useT } from '../../i18n'
import { Panel } from '../../widgets/layout/Panel'

/** The way from a drive that was just connected to a tuned and documented axis, page by page. */
const STEPS = [
  { name: 'compare', page: 'parameters' },
  { name: 'mechanics', page: 'setup' },
  { name: 'terminals', page: 'io' },
  { name: 'jog', page: 'motion' },
  { name: 'tune', page: 'tune' },
  { name: 'save', page: 'parameters' },
] as const

export function WhatNext({ drive }: { drive: string }) {
  const t = useT()
  const has = { io: useHasIo(drive), tune: useCanTune(drive) }
  const steps = STEPS.filter(
    ({ page }) => (page !== 'io' || has.io) && (page !== 'tune' || has.tune),
  )
  return (
    <Panel title={t('next.title')}>
      <ol className="what-next">
        {steps.map(({ name, page }) => (
          <li key={name}>
            <a className="lone" href={href(page, drive)}>
              {t(`page.${page}`)}
            </a>
            <span>{t(`next.${name}`)}</span>
          </li>
        ))}
      </ol>
    </Panel>
  )
}
