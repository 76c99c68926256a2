import { Button } from '@mantine/core'
import { type ReactNode, useEffect, useState } from 'react'
import { useT } from '../../i18n'

const SHOWN_MS = 12000

/**
 * Starts what moves an axis. What is in the way, as text, or null: the button is then dim, and a
 * press states why nothing began. A drive that misses one answer would otherwise swallow a press
 * unseen.
 */
export function StartButton({
  obstacle,
  busy,
  onStart,
  children,
}: {
  obstacle: string | null
  busy: boolean
  onStart: () => void
  children: ReactNode
}) {
  const t = useT()
  const [reported, setTold] = useState<string | null>(null)
  useEffect(() => {
    if (reported === null) return
    if (busy) setTold(null)
    const timer = setTimeout(() => setTold(null), SHOWN_MS)
    return () => clearTimeout(timer)
  }, [reported, busy])
  return (
    <>
      <Button
        variant="filled"
        {...(obstacle !== null ? { 'data-disabled': true } : {})}
        aria-disabled={obstacle !== null}
        loading={busy}
        onClick={() => {
          setTold(obstacle)
          if (obstacle === null) onStart()
        }}
      >
        {children}
      </Button>
      {reported !== null && (
        <p className="note warn not-begun" role="alert">
          <strong>{t('start.not')}</strong> {reported}
        </p>
      )}
    </>
  )
}
