import { useEffect, useState } from 'react'
import { keep, kept } from './kept'

/** A number kept in this browser for one drive. `start` undefined: not known yet. */
export function useRemembered(
  drive: string,
  name: string,
  start: number | null | undefined,
): [number | null, (value: number | null) => void] {
  const place = `servodeck.${drive}.${name}`
  const [value, setValue] = useState<number | null>(() => read(place) ?? start ?? null)
  useEffect(() => {
    setValue(read(place) ?? start ?? null)
  }, [place, start])
  return [
    value,
    (next) => {
      setValue(next)
      if (next !== null) keep(place, String(next))
    },
  ]
}

function read(place: string): number | null {
  const stored = kept(place)
  const number = stored === null ? Number.NaN : Number(stored)
  return Number.isFinite(number) ? number : null
}
