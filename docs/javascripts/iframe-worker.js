// A page that was opened as a file may start no Worker. The search then runs in a hidden frame,
// which the theme recognises by the name IFrameWorker.
if (location.protocol === 'file:') {
  class IFrameWorker extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement('iframe')
      frame.hidden = true
      document.body.append(frame)
      this.inside = frame.contentWindow
      this.inside.postMessage = (data) => this.dispatchEvent(new MessageEvent('message', { data }))
      this.inside.importScripts = async (...urls) => {
        for (const each of urls) await this.load(each)
      }
      this.loaded = this.load(url)
    }
    load(url) {
      const { document: page } = this.inside
      return new Promise((resolve, reject) => {
        const script = page.createElement('script')
        script.onload = resolve
        script.onerror = () => reject(new Error(`${url} cannot be read`))
        script.src = new URL(url, document.baseURI).href
        page.body.append(script)
      })
    }
    postMessage(data) {
      void this.loaded.then(() =>
        this.inside.dispatchEvent(new this.inside.MessageEvent('message', { data })),
      )
    }
    terminate() {
      this.inside.frameElement.remove()
    }
  }
  window.IFrameWorker = IFrameWorker
  window.Worker = IFrameWorker
}
