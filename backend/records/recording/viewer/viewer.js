// Starts rerun's own viewer and feeds it: live from its feed, or a stored recording's .rrd.
// The page around it hears what happens by messages; this frame shows no words of its own.
'use strict'

/** The viewer keeps what it is given, about twice its size; after this much it begins anew. */
const MOST_BYTES = 400e6
const FRAME_MAGIC = 0x44464552
const version = document.documentElement.dataset.version
const query = new URLSearchParams(location.search)

const shown = { phase: 'loading', fraction: 0, bytes: 0, blobs: 0, dropped: 0, problem: '' }

function tell(change) {
  Object.assign(shown, change)
  parent.postMessage({ source: 'servodeck-rerun', ...shown }, location.origin)
}

/** The viewer's program, with progress; it is 43 MB and is sent compressed. */
async function program() {
  const answer = await fetch(`${version}/re_viewer_bg.wasm`)
  if (!answer.ok) throw new Error((await answer.json()).detail)
  const total = Number(answer.headers.get('rerun-final-length')) || 1
  let loaded = 0
  const counted = answer.body.pipeThrough(
    new TransformStream({
      transform(chunk, controller) {
        loaded += chunk.byteLength
        tell({ fraction: Math.min(1, loaded / total) })
        controller.enqueue(chunk)
      },
    }),
  )
  return new Response(counted, { headers: { 'Content-Type': 'application/wasm' } })
}

function live(handle) {
  const socket = new WebSocket(new URL('feed', location.href.replace(/^http/, 'ws')))
  socket.binaryType = 'arraybuffer'
  let channel = null
  let received = 0
  socket.onopen = () => socket.send('pull')
  socket.onclose = () => {
    tell({ phase: 'lost' })
    setTimeout(() => live(handle), 2000)
    if (channel) handle.close_channel(channel)
  }
  socket.onmessage = ({ data }) => {
    const view = new DataView(data)
    if (view.getUint32(0, true) !== FRAME_MAGIC) throw new Error('not a frame of the feed')
    const wanted = `live-${view.getUint32(4, true)}`
    const count = view.getUint32(8, true)
    const dropped = view.getUint32(12, true)
    if (wanted !== channel) {
      if (channel) handle.close_channel(channel)
      channel = wanted
      handle.open_channel(channel, 'servodeck')
    }
    let at = 16
    for (let n = 0; n < count; n++) {
      const length = view.getUint32(at, true)
      handle.send_rrd_to_channel(channel, new Uint8Array(data, at + 4, length))
      at += 4 + length
    }
    received += data.byteLength
    tell({
      phase: 'live',
      bytes: received,
      blobs: shown.blobs + count,
      dropped: shown.dropped + dropped,
    })
    if (received > MOST_BYTES) {
      location.reload()
      return
    }
    // A hidden page pulls slowly; what it does not take is dropped and counted by the server.
    setTimeout(() => socket.readyState === 1 && socket.send('pull'), document.hidden ? 1000 : 40)
  }
}

async function stored(handle, name) {
  const answer = await fetch(`../api/v1/recordings/${encodeURIComponent(name)}/exports/rrd`)
  if (!answer.ok) throw new Error((await answer.json()).detail)
  const data = new Uint8Array(await answer.arrayBuffer())
  handle.open_channel('stored', name)
  handle.send_rrd_to_channel('stored', data)
  handle.close_channel('stored')
  tell({ phase: 'stored', bytes: data.byteLength, blobs: 1 })
}

async function main() {
  await wasm_bindgen({ module_or_path: await program() })
  const handle = new wasm_bindgen.WebHandle({
    render_backend: 'webgl', // software WebGPU crashes it
    hide_welcome_screen: true,
    enable_history: false,
    notebook: false,
    persist: false,
    theme: query.get('theme') === 'light' ? 'light' : 'dark',
  })
  await handle.start(document.getElementById('viewer'))
  tell({ phase: 'started', fraction: 1 })
  setInterval(() => {
    if (handle.has_panicked()) tell({ phase: 'broken', problem: handle.panic_message() ?? '' })
  }, 1000)
  const name = query.get('recording')
  if (name) await stored(handle, name)
  else live(handle)
}

main().catch((error) => tell({ phase: 'broken', problem: String(error.message ?? error) }))
