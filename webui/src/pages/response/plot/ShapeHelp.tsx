import { useT } from '../../../i18n'
import { fixed } from './bode'
import type { Sweep } from '../results'
import { judge, SHAPES } from './shapes'

/** What the curve says about the machine, and what to look at before any filter is set. */
export function ShapeHelp({ sweep, over }: { sweep: Sweep; over: Sweep | null }) {
  const t = useT()
  const { load, ratio, hints } = judge(sweep, over)
  return (
    <>
      {load && (
        <p>
          {t(`shape.load.${load}`)}
          {ratio !== null && ` ${t('shape.ratio', { ratio: fixed(ratio, 1) })}`}
        </p>
      )}
      {hints.map((each) => (
        <p key={each} className="note warn">
          {t(`shape.hint.${each}`)}
        </p>
      ))}
      <details>
        <summary>{t('shape.title')}</summary>
        <p className="dim">{t('shape.first')}</p>
        <ul className="shapes">
          {SHAPES.map(({ name, line }) => (
            <li key={name}>
              <svg viewBox="0 0 100 60" aria-hidden="true">
                <path d="M4 2V58H98" className="axes" />
                <path d={line} />
              </svg>
              <div>
                <strong>{t(`shape.${name}`)}</strong>
                <p>{t(`shape.${name}.text`)}</p>
              </div>
            </li>
          ))}
        </ul>
      </details>
    </>
  )
}
