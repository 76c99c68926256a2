import { type KeyboardEvent, type PointerEvent, useEffect, useRef, useState } from 'react'
import type { AxisState, JogEnded } from '../../../api/schema'
import { type Say, type T, useSay, useT } from '../../../i18n'
import { useJob } from '../../../live/store'
import { quantity } from '../../../widgets/numbers/format'
import { Icon } from '../../../widgets/layout/Icon'
import { Panel } from '../../../widgets/layout/Panel'
import { ProblemNote } from '../../../widgets/messages/ProblemNote'
import { useObstacle } from '../../../widgets/jobs/useObstacle'
import { Acceleration, Speed, TorqueLimit, TravelLimit } from '../fields/fields'
import type { TravelUnit } from '../fields/travelUnit'
import { type JogSettings, useJog } from './useJog'
import { useMotionNumbers } from '../fields/useMotionNumbers'

/** How long it is informed of the reason why a press began nothing. */
const SHOWN_MS = 12000

/** Hold to run: by mouse, finger or arrow key; whatever ends the hold stops the axis. */
export function JogPanel({
  drive,
  state,
  unit,
}: {
  drive: string
  state: AxisState | null
  unit: TravelUnit
}) {
  const t = useT()
  const say = useSay()
  const { units } = unit
  const numbers = useMotionNumbers(drive, unit, 'jog', 5)
  const [speed, acceleration] = [numbers.speed.value, numbers.acceleration.value]
  const [travel, torque] = [numbers.travel.value, numbers.torque.value]
  const settings: JogSettings | null =
    speed !== null && acceleration !== null && travel !== null && torque !== null
      ? { speed, acceleration, travel_limit: travel, torque_limit: torque, unit: unit.name }
      : null
  const { direction, ended, ending, gap, hold, press } = useJog(drive, settings)
  const running = direction !== null
  const taken = !running && state?.moving_job != null
  const job = useJob(state?.moving_job ?? null)
  const inTheWay = useObstacle(drive)
  const obstacle = running
    ? null
    : taken && ending
      ? t('jog.ending')
      : (inTheWay ?? (settings ? null : t('jog.invalid')))
  const [reported, setTold] = useState<string | null>(null)
  useEffect(() => {
    if (reported === null) return
    const timer = setTimeout(() => setTold(null), SHOWN_MS)
    return () => clearTimeout(timer)
  }, [reported])
  /**
   * A press that begins nothing states the reason: a lost answer of the drive is soon over and
   * unseen.
   */
  const begin = (towards: -1 | 1): boolean => {
    if (hold.held !== null) return press(towards) // which ends it
    const begun = obstacle === null && press(towards)
    setTold(begun ? null : (obstacle ?? t('start.unfocused')))
    return begun
  }
  const pad = useRef<HTMLDivElement>(null)
  const keys: Record<string, -1 | 1> = { ArrowLeft: -1, ArrowRight: 1 }
  const keyDown = (event: KeyboardEvent) => {
    const towards = keys[event.key]
    if (towards === undefined || event.target !== pad.current) {
      if (hold.held !== null && !event.repeat) hold.release('another-key')
      return
    }
    event.preventDefault()
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) return
    begin(towards)
  }
  const keyUp = (event: KeyboardEvent) => {
    if (keys[event.key] !== undefined) hold.release('released')
  }
  return (
    <Panel title={t('jog.title')} className="jog-panel">
      <div className="fields">
        <Speed units={units} {...numbers.speed} disabled={running} />
        <Acceleration units={units} {...numbers.acceleration} disabled={running} />
        <TravelLimit units={units} {...numbers.travel} disabled={running} />
        <TorqueLimit {...numbers.torque} disabled={running} />
      </div>
      <div
        ref={pad}
        className="jog-pad"
        role="group"
        tabIndex={0}
        aria-label={t('jog.pad')}
        onKeyDown={keyDown}
        onKeyUp={keyUp}
        onBlur={() => hold.release('focus-lost')}
      >
        <JogButton
          towards={-1}
          held={direction}
          disabled={obstacle !== null}
          press={begin}
          hold={hold}
          pad={pad}
        />
        <div className="jog-live">
          <span className="big num">
            {quantity(shown(state?.position, unit.travel), units.position ?? '')}
          </span>
          <span className="unit">{units.position}</span>
          <span className="jog-figure">
            <span className="num">
              {quantity(shown(state?.velocity, unit.speed), units.velocity ?? '')}
            </span>
            <span className="unit">{units.velocity}</span>
          </span>
          <strong aria-live="polite">
            {direction === null ? t('jog.idle') : t(direction > 0 ? 'jog.plus' : 'jog.minus')}
          </strong>
        </div>
        <JogButton
          towards={1}
          held={direction}
          disabled={obstacle !== null}
          press={begin}
          hold={hold}
          pad={pad}
        />
      </div>
      <p className="dim keys-help">{t('jog.keys')}</p>
      {/* Below the buttons, which a thumb must reach on a phone without scrolling. */}
      <p className="dim">{t('jog.help')}</p>
      {taken && (
        // A jog that was let go needs a moment to brake and tidy up, on a slow bus a long one.
        <p className={ending ? 'dim' : 'warn-text'} role="status">
          {ending ? t('jog.ending') : t('jog.taken', { title: job ? say.title(job) : '…' })}
        </p>
      )}
      {!settings && <p className="warn-text">{t('jog.invalid')}</p>}
      {reported !== null && !running && (
        <p className="note warn not-begun" role="alert">
          <strong>{t('start.not')}</strong> {reported}
        </p>
      )}
      {gap && (
        <p className="note warn" role="status">
          {t(running && gap.braking ? 'jog.gap' : gap.braking ? 'jog.gapEnded' : 'jog.gapOver', {
            ms: Math.round(gap.gap_ms),
          })}
        </p>
      )}
      {ended && !ended.problem && (
        <p className="note" role="status">
          {endOf(ended, t, say)}
        </p>
      )}
      <ProblemNote problem={ended?.problem ?? null} />
    </Panel>
  )
}

/** Why a jog ended, and what to do about it. */
function endOf(ended: JogEnded, t: T, say: Say): string {
  const reason = say.message(ended.reason_message, ended.reason)
  const remedy = say.message(ended.remedy_message, ended.remedy)
  return t(remedy ? 'jog.endedRemedy' : 'jog.ended', { reason, remedy })
}

const shown = (value: number | null | undefined, convert: (value: number) => number) =>
  value == null ? null : convert(value)

function JogButton({
  towards,
  held,
  disabled,
  press,
  hold,
  pad,
}: {
  towards: -1 | 1
  held: -1 | 1 | null
  disabled: boolean
  press: (towards: -1 | 1) => boolean
  hold: { held: -1 | 1 | null; release(reason: 'released' | 'pointer-cancelled'): void }
  pad: React.RefObject<HTMLDivElement | null>
}) {
  const t = useT()
  const pointer = useRef<number | null>(null)
  const down = (event: PointerEvent<HTMLButtonElement>) => {
    if (event.button !== 0) return
    event.preventDefault()
    if (hold.held !== null) {
      hold.release('pointer-cancelled')
      return
    }
    if (disabled) {
      press(towards)
      return
    }
    // The captured pointer's end comes here wherever the finger has slid to.
    event.currentTarget.setPointerCapture(event.pointerId)
    pad.current?.focus({ preventScroll: true })
    if (press(towards)) pointer.current = event.pointerId
  }
  const up = (reason: 'released' | 'pointer-cancelled') => (event: PointerEvent) => {
    if (pointer.current !== event.pointerId) return
    pointer.current = null
    hold.release(reason)
  }
  // A mouse whose other button is held down as well lets go of this one with a move alone.
  const move = (event: PointerEvent) => {
    if ((event.buttons & 1) === 0) up('released')(event)
  }
  return (
    <button
      type="button"
      className="jog-button"
      tabIndex={-1}
      aria-label={t(towards > 0 ? 'jog.buttonPlus' : 'jog.buttonMinus')}
      aria-pressed={held === towards}
      aria-disabled={disabled}
      onPointerDown={down}
      onPointerMove={move}
      onPointerUp={up('released')}
      onPointerCancel={up('pointer-cancelled')}
      onLostPointerCapture={up('pointer-cancelled')}
      onContextMenu={(event) => event.preventDefault()}
    >
      <Icon name={towards > 0 ? 'right' : 'left'} size={40} />
      <span>{towards > 0 ? '+' : '−'}</span>
    </button>
  )
}
