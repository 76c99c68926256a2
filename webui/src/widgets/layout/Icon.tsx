const PATHS = {
  menu: 'M3 6h18M3 12h18M3 18h18',
  connect: 'M9 2v6M15 2v6M6 8h12v4a6 6 0 0 1-12 0zM12 18v4',
  overview: 'M4 13a8 8 0 0 1 16 0M12 13l4-4M4 18h16',
  parameters: 'M4 5h16M4 10h16M4 15h16M4 20h16M10 5v15',
  motion: 'M3 12h18M16 7l5 5-5 5M8 7l-5 5 5 5',
  scope: 'M2 12h4l3-8 5 16 3-8h5',
  tune: 'M6 3v8M6 17v4M3 14h6M12 3v2M12 11v10M9 8h6M18 3v10M18 19v2M15 16h6',
  response: 'M3 14h5c3 0 2-9 4-9s2 13 4 13c2 0 2 2 5 2',
  gains: 'M4 20V9M4 5V4M4 9h0M2 9h4M12 20v-6M12 10V4M10 12h4M20 20v-3M20 13V4M18 15h4',
  setup:
    'M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8M12 2v4M12 18v4M2 12h4M18 12h4M5 5l3 3M16 16l3 3M19 5l-3 3M8 16l-3 3',
  io: 'M4 7h10a4 4 0 0 1 0 8H4M20 11h-2M4 4v6M4 12v6',
  alarms: 'M12 3 2 21h20zM12 10v5M12 18v.5',
  rerun: 'M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18M12 9a3 3 0 1 0 0 6 3 3 0 0 0 0-6',
  scene: 'M12 2 3 7v10l9 5 9-5V7zM3 7l9 5 9-5M12 12v10',
  audit: 'M5 3h14v18H5zM8 8h8M8 12h4M9 16l2 2 5-5',
  files: 'M5 3h9l5 5v13H5zM14 3v5h5M8 13h8M8 17h8',
  people:
    'M9 4a3.5 3.5 0 1 0 0 7 3.5 3.5 0 0 0 0-7M3 20c0-4 2.5-6 6-6s6 2 6 6M16 5a3 3 0 0 1 0 6M17 14c2.5.5 4 2.5 4 6',
  check: 'M4 12l5 6L20 5',
  cross: 'M5 5l14 14M19 5 5 19',
  play: 'M7 4v16l13-8z',
  pause: 'M7 4v16M17 4v16',
  hold: 'M6 4h12v16H6z',
  lock: 'M6 11h12v10H6zM8 11V7a4 4 0 0 1 8 0v4',
  unlock: 'M6 11h12v10H6zM8 11V7a4 4 0 0 1 7-2.6',
  star: 'M12 3l2.7 6 6.3.7-4.7 4.3 1.3 6.5L12 17.2 6.4 20.5l1.3-6.5L3 9.7 9.3 9z',
  link: 'M3 20v-4M8 20v-8M13 20V8M18 20V4',
  question: 'M9 9a3 3 0 1 1 4 2.8c-.8.4-1 1-1 2.2M12 18v.5M12 2a10 10 0 1 0 0 20 10 10 0 0 0 0-20',
  clock: 'M12 7v5l4 2M12 2a10 10 0 1 0 0 20 10 10 0 0 0 0-20',
  left: 'M20 12H4M10 6l-6 6 6 6',
  right: 'M4 12h16M14 6l6 6-6 6',
  theme: 'M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 0 1 0 18',
  download: 'M12 3v12M7 11l5 5 5-5M4 21h16',
  upload: 'M12 16V4M7 9l5-5 5 5M4 21h16',
  bolt: 'M13 2 5 14h6l-1 8 8-12h-6z',
} as const

export type IconName = keyof typeof PATHS

/** A line drawing; its meaning is always also written next to it or in the control's name. */
export function Icon({ name, size = 18 }: { name: IconName; size?: number }) {
  return (
    <svg
      className="icon"
      width={size}
      height={size}
      viewBox="0 0 24 24"
      fill="none"
      stroke="currentColor"
      strokeWidth={2.2}
      strokeLinecap="round"
      strokeLinejoin="round"
      aria-hidden="true"
      focusable="false"
    >
      <path d={PATHS[name]} />
    </svg>
  )
}
