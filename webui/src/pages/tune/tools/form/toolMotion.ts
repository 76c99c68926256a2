import type { ToolInfo } from '../../../../api/schema'

/**
 * Whether the form of a tool warns of its motion. A tool with a greater danger states that in its
 * own words, above its form.
 */
export const warnsOfMotion = (tool: Pick<ToolInfo, 'motion' | 'texts'>): boolean =>
  tool.motion && !('danger' in tool.texts)
