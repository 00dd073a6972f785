/** The form for those whom the service does not know yet. */
import type { TargetedEvent, VNode } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";

import type { ProblemError } from "../api/client";
import { signIn } from "../state/session";
import { Failure } from "./failure";
import "./sign-in.css";
import { ThemeButton } from "./theme-button";

/** Ask for an API key, and start a session with it. */
export function SignIn({ problem }: { problem: ProblemError | null }): VNode {
  const [key, setKey] = useState("");
  const [busy, setBusy] = useState(false);
  const field = useRef<HTMLInputElement>(null);
  useEffect(() => {
    document.title = "Sign in · Spinewatch";
    field.current?.focus();
  }, [problem]);

  const submit = (event: TargetedEvent<HTMLFormElement, SubmitEvent>): void => {
    event.preventDefault();
    setBusy(true);
    void signIn(key).finally(() => {
      setBusy(false);
      setKey("");
    });
  };

  return (
    <main class="sign-in">
      <form class="panel stack" onSubmit={submit}>
        <img src="/icon.svg" alt="" width="48" height="48" />
        <h1>Spinewatch</h1>
        <p class="muted">This page shows data of surgeries. Sign in with an API key of this service.</p>
        {problem !== null && <Failure problem={problem} />}
        <div class="field">
          <label for="key">API key</label>
          <input
            id="key"
            ref={field}
            type="password"
            autocomplete="off"
            spellcheck={false}
            required
            placeholder="sw_…"
            value={key}
            aria-describedby="key-hint"
            onInput={(event) => setKey(event.currentTarget.value)}
          />
          <p class="hint" id="key-hint">
            Made by <code>spinewatch key create</code> on the machine of the service. It is sent once, and not kept by the browser.
          </p>
        </div>
        <button class="button button-primary" disabled={busy || key.trim() === ""}>
          {busy ? "Signing in …" : "Sign in"}
        </button>
        <p class="row spread small">
          <a href="/docs">The HTTP API</a>
          <ThemeButton />
        </p>
      </form>
      <p class="muted small">Spinewatch is not a medical device.</p>
    </main>
  );
}
