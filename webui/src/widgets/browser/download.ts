/** Hand a text to the browser as a file. */
export function offerDownload(name: string, parts: BlobPart[], type: string): void {
  const url = URL.createObjectURL(new Blob(parts, { type }))
  const anchor = document.createElement('a')
  anchor.href = url
  anchor.download = name
  anchor.click()
  // The browser has taken the data over by the time the next task runs.
  setTimeout(() => URL.revokeObjectURL(url), 1000)
}
