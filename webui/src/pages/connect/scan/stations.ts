/** `1-5, 9` as station numbers; null where it is not such a list. */
export function parseStations(text: string): number[] | null {
  const stations: number[] = []
  for (const part of text.split(',').map((each) => each.trim())) {
    const match = /^(\d{1,5})(?:\s*[-–]\s*(\d{1,5}))?$/.exec(part)
    if (!match) return null
    const first = Number(match[1])
    const last = Number(match[2] ?? match[1])
    if (last < first || last > 65535 || last - first > 1000) return null
    for (let station = first; station <= last; station++) stations.push(station)
  }
  return stations
}
