/** Image files of the service as gray levels. */
import { useEffect, useState } from "preact/hooks";

import { noConnection, ProblemError, problemOf } from "../api/client";
import { decodePicture } from "./decode/picture";
import { PictureError } from "./decode/parts";
import type { Picture } from "./levels";

export type PictureState =
  | { state: "loading" }
  | { state: "failed"; message: string }
  | { state: "ready"; picture: Picture };

/** Pictures that were shown last, by their path. */
const kept = new Map<string, Promise<Picture>>();
const MAX_KEPT = 6;

/** Use the image file at a path of the API; null uses none. */
export function usePicture(path: string | null): PictureState {
  const [content, setContent] = useState<{ path: string | null; state: PictureState }>({ path: null, state: { state: "loading" } });
  useEffect(() => {
    if (path === null) return undefined;
    let wanted = true;
    const show = (state: PictureState): void => {
      if (wanted) setContent({ path, state });
    };
    pictureAt(path).then(
      (picture) => show({ state: "ready", picture }),
      (error: unknown) => show({ state: "failed", message: messageOf(error) }),
    );
    return () => {
      wanted = false;
    };
  }, [path]);
  return content.path === path ? content.state : { state: "loading" };
}

function pictureAt(path: string): Promise<Picture> {
  const before = kept.get(path);
  kept.delete(path);
  const picture = before ?? fetched(path);
  kept.set(path, picture);
  if (before === undefined) picture.catch(() => kept.delete(path));
  for (const oldest of kept.keys()) {
    if (kept.size <= MAX_KEPT) break;
    kept.delete(oldest);
  }
  return picture;
}

async function fetched(path: string): Promise<Picture> {
  const response = await fetch(path, { credentials: "same-origin" }).catch(() => {
    throw noConnection();
  });
  if (!response.ok) throw problemOf(response.status, await response.text());
  const bytes = new Uint8Array(await response.arrayBuffer());
  return decodePicture(bytes, response.headers.get("Content-Type") ?? "");
}

function messageOf(error: unknown): string {
  if (error instanceof ProblemError) return error.detail;
  return error instanceof PictureError ? error.message : "The image cannot be shown. Download it to look at it.";
}
