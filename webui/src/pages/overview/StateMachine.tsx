import { Fragment } from 'react'
import { known, useLanguage, useT } from '../../i18n'
import { ArrowTip, DrawnButton } from '../../widgets/layout/drawn'

/** Boxes of the picture: centre, in the units of the drawing. After CiA 402-2 figure 6. */
const BOXES: { state: string; x: number; y: number }[] = [
  { state: 'Not ready to switch on', x: 105, y: 26 },
  { state: 'Switch on disabled', x: 105, y: 92 },
  { state: 'Ready to switch on', x: 105, y: 158 },
  { state: 'Switched on', x: 105, y: 224 },
  { state: 'Operation enabled', x: 105, y: 290 },
  { state: 'Fault reaction active', x: 330, y: 26 },
  { state: 'Fault', x: 330, y: 92 },
  { state: 'Quick stop active', x: 330, y: 290 },
]
const WIDTH = 178
/** 44 px under a finger on a phone, where the picture is drawn smaller. */
const HEIGHT = 54

const ARROWS = [
  'M105 53V65',
  'M92 119V131M118 131V119',
  'M92 185V197M118 197V185',
  'M92 251V263M118 263V251',
  'M194 290H241',
  'M330 263V138H217V104H194',
  'M330 53V65',
  'M241 84H194',
]

/** The power state machine. States that can be asked for now are buttons. */
export function StateMachine({
  state,
  goals,
  busy,
  onGoal,
}: {
  state: string | null
  goals: string[]
  busy: boolean
  onGoal: (goal: string) => void
}) {
  const t = useT()
  // The manuals print the states in English: a translation stands with the original.
  const both = useLanguage() !== 'en'
  return (
    <svg className="state-machine" viewBox="0 -3 436 323" aria-label={t('overview.machine')}>
      <title>{t('overview.machine')}</title>
      <ArrowTip id="tip" />
      {ARROWS.flatMap((path) => path.split(/(?=M)/)).map((path) => (
        <path key={path} d={path} className="arrow" markerEnd="url(#tip)" />
      ))}
      {BOXES.map((box) => {
        const name = known(t, 'state', box.state)
        const now = state === box.state
        const allowed = goals.includes(box.state) && !now
        const look = `box ${now ? 'now' : ''} ${allowed ? 'allowed' : ''} ${
          box.state.startsWith('Fault') ? 'bad' : ''
        }`
        const drawing = (
          <>
            <rect
              x={box.x - WIDTH / 2}
              y={box.y - HEIGHT / 2}
              width={WIDTH}
              height={HEIGHT}
              rx={4}
            />
            <text x={box.x} y={box.y + (allowed || now ? -2 : 5) - (both ? 8 : 0)}>
              {name}
            </text>
          </>
        )
        // Outside of the button, whose name is the state alone.
        const hints = (
          <g className={allowed ? 'allowed' : undefined} aria-hidden="true" pointerEvents="none">
            {both && (
              <text
                x={box.x}
                y={box.y + (allowed || now ? 5 : 14)}
                className="hint"
                aria-hidden="true"
              >
                ({box.state})
              </text>
            )}
            {(allowed || now) && (
              <text x={box.x} y={box.y + (both ? 21 : 14)} className="hint" aria-hidden="true">
                {t(now ? 'overview.here' : 'overview.goThere')}
              </text>
            )}
          </g>
        )
        if (!allowed) {
          return (
            <g key={box.state} className={look}>
              {drawing}
              {hints}
            </g>
          )
        }
        return (
          <Fragment key={box.state}>
            <DrawnButton
              className={look}
              label={t('overview.goTo', { state: name })}
              busy={busy}
              onPress={() => onGoal(box.state)}
            >
              {drawing}
            </DrawnButton>
            {hints}
          </Fragment>
        )
      })}
    </svg>
  )
}
