import '../../widgets/layout/functions.css'
import type { GainBlock } from '../../api/schema'
import { useT } from '../../i18n'
import { ArrowTip, DrawnButton } from '../../widgets/layout/drawn'

type Block = GainBlock['block']

const WIDTH = 128
/** 44 px where the picture is drawn at its least width. */
const HEIGHT = 58

/** Where each block of the loops is drawn: centre, in the units of the drawing. */
const PLACES: { block: Block; x: number; y: number; width?: number }[] = [
  { block: 'speed_ff', x: 250, y: 36, width: 160 },
  { block: 'torque_ff', x: 450, y: 36, width: 160 },
  { block: 'command_filter', x: 78, y: 112 },
  { block: 'position', x: 262, y: 112 },
  { block: 'speed', x: 446, y: 112 },
  { block: 'torque_filter', x: 630, y: 112 },
  { block: 'notch', x: 778, y: 112 },
  { block: 'current', x: 926, y: 112 },
  { block: 'feedback_filter', x: 630, y: 200 },
]
/** Those that act on several loops stand below, without wires. */
const SIDE_BLOCKS: Block[] = ['level', 'inertia', 'switching', 'adaptive', 'compensation', 'limits']

const SUM_POSITION = 168
const SUM_SPEED = 356
const SUM_TORQUE = 540
const MOTOR = { x: 1068, y: 112 }
const LINE = 112

/** The control loops of a drive; a block is a button that goes to its parameters. */
export function LoopPicture({
  present,
  onBlock,
}: {
  present: ReadonlySet<string>
  onBlock: (block: Block) => void
}) {
  const t = useT()
  const sideBlocks = SIDE_BLOCKS.filter((block) => present.has(block))
  const has = (block: Block) => present.has(block)
  const wires = [
    `M140 ${LINE}H${SUM_POSITION - 9}`,
    `M${SUM_POSITION + 9} ${LINE}H200`,
    `M324 ${LINE}H${SUM_SPEED - 9}`,
    `M${SUM_SPEED + 9} ${LINE}H384`,
    `M508 ${LINE}H${SUM_TORQUE - 9}`,
    `M${SUM_TORQUE + 9} ${LINE}H568`,
    `M692 ${LINE}H716`,
    `M840 ${LINE}H864`,
    `M988 ${LINE}H${MOTOR.x - 40}`,
    // Speed feedback through its filter, and position feedback below it.
    `M${MOTOR.x} 135V200H692`,
    `M568 200H${SUM_SPEED}V${LINE + 9}`,
    `M${MOTOR.x} 200V246H${SUM_POSITION}V${LINE + 9}`,
    ...(has('speed_ff') ? [`M152 ${LINE}V36H170`, `M330 36H${SUM_SPEED}V${LINE - 9}`] : []),
    ...(has('torque_ff') ? [`M330 36H370`, `M530 36H${SUM_TORQUE}V${LINE - 9}`] : []),
  ]
  return (
    <div className="loop-picture">
      <svg viewBox="0 0 1120 330" role="group" aria-label={t('gains.picture')}>
        <title>{t('gains.picture')}</title>
        <ArrowTip id="loop-tip" />
        {wires.map((path) => (
          <path key={path} d={path} className="wire" markerEnd="url(#loop-tip)" />
        ))}
        {[SUM_POSITION, SUM_SPEED, SUM_TORQUE].map((x) => (
          <circle key={x} cx={x} cy={LINE} r={9} className="sum" />
        ))}
        {PLACES.map(({ block, x, y, width }) => (
          <Box
            key={block}
            block={block}
            x={x}
            y={y}
            width={width ?? WIDTH}
            present={has(block)}
            onBlock={onBlock}
          />
        ))}
        <g className="motor">
          <circle cx={MOTOR.x} cy={MOTOR.y} r={38} />
          <text x={MOTOR.x} y={MOTOR.y + 5}>
            {t('block.motor')}
          </text>
        </g>
        {sideBlocks.map((block, i) => (
          <Box
            key={block}
            block={block}
            x={78 + (i * (1120 - 156)) / Math.max(1, SIDE_BLOCKS.length - 1)}
            y={298}
            width={WIDTH}
            present
            onBlock={onBlock}
          />
        ))}
      </svg>
    </div>
  )
}

function Box({
  block,
  x,
  y,
  width,
  present,
  onBlock,
}: {
  block: Block
  x: number
  y: number
  width: number
  present: boolean
  onBlock: (block: Block) => void
}) {
  const t = useT()
  const drawing = (
    <>
      <rect x={x - width / 2} y={y - HEIGHT / 2} width={width} height={HEIGHT} rx={4} />
      <text x={x} y={y + 5}>
        {t(`block.${block}`)}
      </text>
    </>
  )
  if (!present) return <g className="box absent">{drawing}</g>
  return (
    <DrawnButton className="box" onPress={() => onBlock(block)}>
      {drawing}
    </DrawnButton>
  )
}
