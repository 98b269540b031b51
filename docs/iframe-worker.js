// Search in a site opened from a folder. Browsers refuse workers to pages of `file://`, so there the
// script of the search runs in a hidden frame. MkDocs' plugin `offline` would load such a script from
// the network.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      document.body.append(frame)
      this.inside = frame.contentWindow
      this.inside.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }))
      const script = this.inside.document.createElement("script")
      this.loaded = new Promise((done, failed) => Object.assign(script, { onload: done, onerror: failed }))
      script.src = url
      this.inside.document.body.append(script)
    }

    async postMessage(data) {
      await this.loaded
      this.inside.dispatchEvent(new MessageEvent("message", { data }))
    }
  }
}
