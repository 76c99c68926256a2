import type uPlot from 'uplot'

/** How every plot draws its axes, in the colours of the present scheme. */
export function axisLook() {
  const style = getComputedStyle(document.documentElement)
  const line = { stroke: style.getPropertyValue('--line'), width: 1 }
  const font = `12px ${getComputedStyle(document.body).fontFamily}`
  return {
    stroke: style.getPropertyValue('--dim'),
    font,
    labelFont: font,
    labelSize: 18,
    grid: line,
    ticks: line,
  } satisfies uPlot.Axis
}
