/** English, then Chinese. */
export type Texts = Record<string, readonly [string, string]>
