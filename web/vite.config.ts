import { basename, dirname } from "node:path";

import { defineConfig } from "vitest/config";

/** The service that a page under development asks. */
const SERVICE = process.env["SPINEWATCH_URL"] ?? "http://127.0.0.1:8000";

// Fixed file names: the built page is committed, and a build from the same sources must give the same files.
export default defineConfig({
  base: "/",
  build: {
    chunkSizeWarningLimit: 600,
    outDir: "../service/dashboard",
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rolldownOptions: {
      output: {
        entryFileNames: "assets/[name].js",
        chunkFileNames: ({ name, facadeModuleId }) => `assets/${chunkName(name, facadeModuleId)}.js`,
        assetFileNames: "assets/[name][extname]",
        codeSplitting: { groups: [{ name: "three", test: /node_modules[\\/]three[\\/]/ }, { name: "uplot", test: /node_modules[\\/]uplot[\\/]/ }] },
      },
    },
  },
  server: { proxy: { "/v1": SERVICE, "/health": SERVICE } },
  preview: { proxy: { "/v1": SERVICE, "/health": SERVICE } },
  test: { environment: "happy-dom", include: ["test/**/*.test.{ts,tsx}"] },
});

/** A chunk that begins with the index of an area has the name of its folder. */
function chunkName(name: string, facade: string | null): string {
  return name === "index" && facade !== null ? basename(dirname(facade)) : name;
}
