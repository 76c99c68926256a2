import {
  ActionIcon,
  Button,
  Checkbox,
  createTheme,
  type MantineColorsTuple,
  Modal,
  NativeSelect,
  SegmentedControl,
  Textarea,
  TextInput,
} from '@mantine/core'

const steel: MantineColorsTuple = [
  '#eaf3f9',
  '#d3e4f0',
  '#a5c8df',
  '#74aacf',
  '#4d92c0',
  '#3582b6',
  '#1f6fa5',
  '#175c8c',
  '#114a72',
  '#083653',
]

/** Blue-grey instead of the library's neutral grey, from text to ground. */
const dark: MantineColorsTuple = [
  '#e9eef3',
  '#c9d3dc',
  '#a9b6c3',
  '#7f90a1',
  '#4a5a69',
  '#313d48',
  '#222c35',
  '#161d24',
  '#10161b',
  '#0d1216',
]

/** Dense and calm; targets of 44 px, system fonts only. `close`: what closing a dialogue is called. */
export const themeWith = (close: string) => ({ ...theme, components: components(close) })

const theme = createTheme({
  colors: { steel, dark },
  primaryColor: 'steel',
  primaryShade: { light: 7, dark: 6 },
  defaultRadius: 3,
  fontFamily:
    'system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "Liberation Sans", "Noto Sans SC", "PingFang SC", "Microsoft YaHei", sans-serif',
  fontFamilyMonospace: 'ui-monospace, "Cascadia Mono", Consolas, "DejaVu Sans Mono", monospace',
  fontSizes: { xs: '12px', sm: '14px', md: '15px', lg: '17px', xl: '20px' },
})

const components = (close: string) => ({
  Button: Button.extend({ defaultProps: { size: 'sm', variant: 'default', px: 12 } }),
  ActionIcon: ActionIcon.extend({ defaultProps: { size: 44, variant: 'subtle' } }),
  TextInput: TextInput.extend({ defaultProps: { size: 'sm' } }),
  Textarea: Textarea.extend({ defaultProps: { size: 'sm' } }),
  NativeSelect: NativeSelect.extend({ defaultProps: { size: 'sm' } }),
  SegmentedControl: SegmentedControl.extend({ defaultProps: { size: 'sm' } }),
  Checkbox: Checkbox.extend({ defaultProps: { size: 'sm' } }),
  Modal: Modal.extend({
    defaultProps: {
      zIndex: 300,
      centered: true,
      closeButtonProps: { size: 44, 'aria-label': close },
    },
  }),
})
