import { createElement, type ReactNode } from 'react'

/** The library's components as bare elements of their name, for tests of the page's own. */
const bare = (name: string) => (props: Record<string, unknown> & { children?: ReactNode }) =>
  createElement(name, props)

export const ActionIcon = bare('ActionIcon')
export const Button = bare('Button')
export const Checkbox = Object.assign(bare('Checkbox'), { Group: bare('Checkbox.Group') })
export const FileButton = (props: {
  onChange: (file: File | null) => void
  children: (props: object) => ReactNode
}) => createElement('FileButton', { onChange: props.onChange } as object, props.children({}))
export const FileInput = bare('FileInput')
export const Modal = bare('Modal')
export const NativeSelect = bare('NativeSelect')
export const NumberInput = bare('NumberInput')
export const PasswordInput = bare('PasswordInput')
export const SegmentedControl = bare('SegmentedControl')
export const TagsInput = bare('TagsInput')
export const Textarea = bare('Textarea')
export const TextInput = bare('TextInput')
export const useComputedColorScheme = () => 'light'
