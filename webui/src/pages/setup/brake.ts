/** Times of a holding brake, in ms and rpm; null where the drive has no such setting. */
interface BrakeTimes {
  openDelay: number | null
  commandDelay: number | null
  closeDelay: number | null
  closeSpeed: number | null
  hold: number | null
}

/** A trace of the picture: times in ms at which it changes, and to what. */
export interface Trace {
  name: 'servo' | 'power' | 'output' | 'command' | 'speed'
  points: [number, number][]
}

interface Course {
  traces: Trace[]
  /** Spans to write a time at: which trace, from, to. */
  spans: { trace: Trace['name']; from: number; to: number; text: string }[]
  end: number
}

const LEAD = 100
const RUN = 300
/** Drawn where the drive has no setting, so that the order can still be seen. */
const UNKNOWN = 80

/**
 * Order of events from servo on to power off: the brake opens, commands act, the axis moves; at
 * servo off it brakes, the brake closes, and the motor stays powered until it holds.
 */
export function brakeCourse(times: BrakeTimes): Course {
  const on = LEAD
  const open = on + (times.openDelay ?? 0)
  const command = open + (times.commandDelay ?? UNKNOWN)
  const off = command + RUN
  // It closes when the speed is low, at the latest after the delay.
  const slow = off + Math.min(times.closeDelay ?? UNKNOWN, RUN)
  const powerOff = slow + (times.hold ?? UNKNOWN)
  const end = powerOff + LEAD
  const spans: Course['spans'] = []
  const span = (
    trace: Trace['name'],
    from: number,
    to: number,
    value: number | null,
    unit = 'ms',
  ) => {
    if (value !== null) spans.push({ trace, from, to, text: `${value} ${unit}` })
  }
  span('output', on, open, times.openDelay)
  span('command', open, command, times.commandDelay)
  span('output', off, slow, times.closeDelay, 'ms ≥')
  span('power', slow, powerOff, times.hold)
  return {
    traces: [
      { name: 'servo', points: steps(on, off, end) },
      { name: 'power', points: steps(on, powerOff, end) },
      { name: 'output', points: steps(open, slow, end) },
      { name: 'command', points: steps(command, off, end) },
      {
        name: 'speed',
        points: [
          [0, 0],
          [command, 0],
          [command + RUN / 3, 1],
          [off, 1],
          [slow, 0.12],
          [slow + 20, 0],
          [end, 0],
        ],
      },
    ],
    spans,
    end,
  }
}

/** Low, high from the first time to the second, low. */
function steps(up: number, down: number, end: number): [number, number][] {
  return [
    [0, 0],
    [up, 0],
    [up, 1],
    [down, 1],
    [down, 0],
    [end, 0],
  ]
}
