/** The texts of each room as they stand in the catalogue, by the name of the room. */
const files: Record<string, string> = import.meta.glob(
  '../../../drivers/texts/catalogue/*/*.en.ftl',
  {
    query: '?raw',
    import: 'default',
    eager: true,
  },
)

export const sources: Record<string, string> = Object.fromEntries(
  Object.entries(files).map(([path, text]) => [/([^/]+)\.en\.ftl$/.exec(path)?.[1] ?? '', text]),
)
