import { type RefObject, useEffect } from 'react'

interface Sheet {
  ctx: CanvasRenderingContext2D
  width: number
  height: number
  /** Where the colours of the present scheme are. */
  style: CSSStyleDeclaration
}

/**
 * A canvas emptied and as large as its element, in CSS pixels; null where it cannot be drawn on.
 */
export function sheetOf(canvas: HTMLCanvasElement): Sheet | null {
  const { clientWidth: width, clientHeight: height } = canvas
  canvas.width = width * devicePixelRatio
  canvas.height = height * devicePixelRatio
  const ctx = canvas.getContext('2d')
  if (!ctx) return null
  ctx.scale(devicePixelRatio, devicePixelRatio)
  ctx.font = `12px ${getComputedStyle(document.body).fontFamily}`
  return { ctx, width, height, style: getComputedStyle(document.documentElement) }
}

/** A label that is read from below. */
export function upwards(ctx: CanvasRenderingContext2D, text: string, x: number, y: number): void {
  ctx.save()
  ctx.translate(x, y)
  ctx.rotate(-Math.PI / 2)
  ctx.textAlign = 'center'
  ctx.fillText(text, 0, 0)
  ctx.restore()
}

/** Draws again when any of `change` does, and when the element gets another size. */
export function useDrawing(
  canvas: RefObject<HTMLCanvasElement | null>,
  draw: (canvas: HTMLCanvasElement) => void,
  change: unknown[],
): void {
  useEffect(() => {
    const element = canvas.current
    if (!element) return
    const now = () => draw(element)
    now()
    const observer = new ResizeObserver(now)
    observer.observe(element)
    return () => observer.disconnect()
  }, change)
}
