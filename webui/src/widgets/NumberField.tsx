import { TextInput } from '@mantine/core'
import { useEffect, useState } from 'react'
import { useT } from '../i18n'

/** A number with its unit. Says at once what is wrong; `null` while it is not a valid number. */
export function NumberField({
  label,
  unit,
  value,
  onChange,
  onInvalid,
  min,
  max,
  above,
  below,
  integer = false,
  optional = false,
  help,
  disabled = false,
}: {
  label: string
  unit?: string
  value: number | null
  onChange: (value: number | null) => void
  /** Instead of `onChange`, for a text that is no valid number. Null is then an empty field only. */
  onInvalid?: () => void
  min?: number
  max?: number
  /** Exclusive lower limit. */
  above?: number
  /** Exclusive upper limit. */
  below?: number
  integer?: boolean
  optional?: boolean
  help?: string
  disabled?: boolean
}) {
  const t = useT()
  const [text, setText] = useState(value === null ? '' : String(value))
  useEffect(() => {
    // A value set from elsewhere replaces the text; one's own typing is left as typed.
    const set = value !== null && !Number.isNaN(value)
    setText((typed) => (set && toNumber(typed) !== value ? String(value) : typed))
  }, [value])
  // An empty form is not a mistake yet; a field that was emptied or left empty is.
  const [touched, setTouched] = useState(false)
  const number = toNumber(text)
  let problem: string | null = null
  if (text.trim() === '') problem = optional || !touched ? null : t('number.missing')
  else if (number === null) problem = t('number.bad')
  else if (integer && !Number.isInteger(number)) problem = t('number.whole')
  else if (above !== undefined && number <= above) problem = t('number.above', { limit: above })
  else if (below !== undefined && number >= below) problem = t('number.below', { limit: below })
  else if (min !== undefined && number < min) problem = t('number.low', { limit: min })
  else if (max !== undefined && number > max) problem = t('number.high', { limit: max })
  const valid = (candidate: number | null) =>
    candidate !== null &&
    (!integer || Number.isInteger(candidate)) &&
    (above === undefined || candidate > above) &&
    (below === undefined || candidate < below) &&
    (min === undefined || candidate >= min) &&
    (max === undefined || candidate <= max)
  return (
    <TextInput
      className="number-field"
      label={label}
      description={help}
      inputMode="decimal"
      disabled={disabled}
      placeholder={optional ? undefined : t('number.needed')}
      aria-required={!optional}
      onBlur={() => setTouched(true)}
      value={text}
      error={problem}
      rightSection={unit ? <span className="unit">{unit}</span> : null}
      rightSectionWidth={unit ? 20 + unit.length * 8 : 0}
      onChange={(event) => {
        setTouched(true)
        setText(event.currentTarget.value)
        const next = toNumber(event.currentTarget.value)
        const wrong = event.currentTarget.value.trim() !== '' && !valid(next)
        if (wrong && onInvalid) onInvalid()
        else onChange(valid(next) ? next : null)
      }}
    />
  )
}

function toNumber(text: string): number | null {
  const plain = text.trim().replace('−', '-').replace(',', '.')
  if (!/^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain)) return null
  return Number(plain)
}
