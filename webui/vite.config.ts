import { readdirSync, readFileSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'
import { gzipSync } from 'node:zlib'
import react from '@vitejs/plugin-react'
import { defineConfig } from 'vitest/config'

/** A packed copy of each asset beside it: the server sends it as it is (backend/api/app.py). */
function packed() {
  return {
    name: 'packed',
    apply: 'build' as const,
    writeBundle(options: { dir?: string | undefined }) {
      const folder = join(options.dir ?? 'dist', 'assets')
      for (const name of readdirSync(folder).filter((each) => /\.(js|css)$/.test(each))) {
        const file = join(folder, name)
        writeFileSync(`${file}.gz`, gzipSync(readFileSync(file), { level: 9 }))
      }
    },
  }
}

export default defineConfig({
  plugins: [react(), packed()],
  base: './',
  build: {
    target: 'es2022',
    // One sheet: a page whose code had to be fetched twice would come without a sheet of its own,
    // since the loader asks for each only once.
    cssCodeSplit: false,
    assetsInlineLimit: 0, // the page's policy allows no data: scripts or workers
    chunkSizeWarningLimit: 900,
    reportCompressedSize: false,
  },
  worker: { format: 'es' },
  server: {
    // The texts of the catalogue stand beside this directory.
    fs: { allow: ['.', '../drivers/texts/catalogue'] },
    proxy: {
      '/api': { target: process.env.SERVODECK_SERVER ?? 'http://127.0.0.1:8000', ws: true },
      '/rerun': { target: process.env.SERVODECK_SERVER ?? 'http://127.0.0.1:8000', ws: true },
    },
  },
  test: {
    environment: 'node',
    include: ['src/**/*.test.{ts,tsx}'],
    pool: 'threads', // a quarter faster than processes
    testTimeout: 60_000, // some show whole pages, also on a busy machine
  },
})
