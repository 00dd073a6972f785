/** Sends a form, with the number of bytes that are on their way. */
import { noConnection, problemOf, ProblemError } from "../api/client";
import type { Stage } from "../api/types";

export interface Transfer<T = Stage> {
  readonly answer: Promise<T>;
  /** Give up; the answer is then rejected with the code `aborted`. */
  abort(): void;
}

/**
 * Send a form to the service. The same `idempotencyKey` for a second attempt makes sure that the stage is stored once,
 * whether or not the first attempt arrived.
 */
export function transfer<T = Stage>(
  path: string,
  form: FormData,
  idempotencyKey: string,
  progress: (sent: number, total: number) => void,
): Transfer<T> {
  const request = new XMLHttpRequest();
  const answer = new Promise<T>((resolve, reject) => {
    request.upload.onprogress = ({ loaded, total }) => progress(loaded, total);
    request.onload = () => {
      if (request.status < 300) resolve(JSON.parse(request.responseText) as T);
      else reject(problemOf(request.status, request.responseText, request.getResponseHeader("Location")));
    };
    request.onerror = () => reject(noConnection());
    request.onabort = () => reject(new ProblemError(0, "aborted", "Not sent", "It was given up before it was sent."));
  });
  request.open("POST", path);
  request.setRequestHeader("Idempotency-Key", idempotencyKey);
  request.send(form);
  return { answer, abort: () => request.abort() };
}
