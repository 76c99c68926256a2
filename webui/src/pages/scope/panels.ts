import type { Shown } from './setup/setup'

/** What a panel beneath the plot needs of the page. */
export interface PanelProps {
  shown: Shown[]
  colors: string[]
  /** Between the cursors, else what is in sight; null before the first picture. */
  stretch: () => { from: number; to: number; origin: number } | null
  running: boolean
  /** Changes when another stretch or another unit is shown. */
  change: string
  dark: boolean
}
