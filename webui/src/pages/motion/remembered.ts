import { useEffect, useState } from 'react'

/** Units in which a usual first value means the same on every axis. */
const USUAL = ['rev', 'rpm', 'rpm/s']

/** A cautious first value, or none where the unit is the drive's own and a number says nothing. */
export function startValue(unit: string | undefined, value: number): number | null | undefined {
  if (unit === undefined) return undefined
  return USUAL.includes(unit) ? value : null
}

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
      if (next !== null) localStorage.setItem(place, String(next))
    },
  ]
}

function read(place: string): number | null {
  const stored = localStorage.getItem(place)
  const number = stored === null ? Number.NaN : Number(stored)
  return Number.isFinite(number) ? number : null
}
