/** All surgeries, and a form for a new one. */
import type { VNode } from "preact";
import { useEffect, useState } from "preact/hooks";

import { get } from "../api/client";
import { Resource, useResource } from "../api/resource";
import type { Surgery, SurgeryPage as SurgeryList } from "../api/types";
import { href, paths } from "../app/route";
import { dayAndTime } from "../format/time";
import { permits } from "../state/session";
import { NewSurgeryForm } from "./new-surgery-form";
import { StateMark } from "./state-mark";
import "./surgeries.css";

const FIRST = "/v1/surgeries?limit=50";

/** The list of surgeries, newest first. */
export function SurgeriesPage(): VNode {
  const first = useResource<SurgeryList>(FIRST);
  const [adding, setAdding] = useState(false);
  useEffect(() => {
    document.title = "Surgeries · Spinewatch";
  }, []);
  return (
    <>
      <div class="page-heading">
        <h1>Surgeries</h1>
        {permits("capture:write") && (
          <button type="button" class="button button-primary" aria-expanded={adding} onClick={() => setAdding(!adding)}>
            {adding ? "Close the form" : "New surgery"}
          </button>
        )}
      </div>
      {adding && <NewSurgeryForm />}
      <Resource
        of={first}
        loading="Loading the surgeries"
        empty={({ total }) => (total > 0 ? null : <NothingYet />)}
      >
        {(page) => <SurgeryTable key={page.items[0]?.id ?? ""} first={page} />}
      </Resource>
    </>
  );
}

function NothingYet(): VNode {
  return (
    <>
      <p>No surgeries yet.</p>
      <p class="small">Add one here, or send stages from a cart; it appears by itself.</p>
    </>
  );
}

function SurgeryTable({ first }: { first: SurgeryList }): VNode {
  const [more, setMore] = useState<{ items: Surgery[]; next: string | null }>({ items: [], next: first.next_cursor });
  const [busy, setBusy] = useState(false);
  const shown = [...first.items, ...more.items];
  const showMore = async (): Promise<void> => {
    if (more.next === null) return;
    setBusy(true);
    try {
      const page = await get<SurgeryList>(`${FIRST}&cursor=${encodeURIComponent(more.next)}`);
      setMore({ items: [...more.items, ...page.items], next: page.next_cursor });
    } finally {
      setBusy(false);
    }
  };
  return (
    <section class="panel" aria-label="List of surgeries">
      <div class="scroll-x" tabIndex={0} role="region" aria-label="Table of surgeries">
        <table class="surgeries">
          <thead>
            <tr>
              <th scope="col">Case number</th>
              <th scope="col">Markers</th>
              <th scope="col">Reference</th>
              <th scope="col" class="number">Stages</th>
              <th scope="col">Newest stage</th>
              <th scope="col">Created</th>
            </tr>
          </thead>
          <tbody>
            {shown.map((surgery) => (
              <SurgeryRow surgery={surgery} />
            ))}
          </tbody>
        </table>
      </div>
      <p class="row spread small muted">
        <span>
          {shown.length} of {first.total}
        </span>
        {more.next !== null && (
          <button type="button" class="button button-small" disabled={busy} onClick={() => void showMore()}>
            Show more
          </button>
        )}
      </p>
    </section>
  );
}

function SurgeryRow({ surgery }: { surgery: Surgery }): VNode {
  const names = new Set(surgery.stages.map(({ name }) => name));
  const newest = surgery.stages.at(-1);
  return (
    <tr>
      <th scope="row">
        <a href={href(paths.surgery(surgery.id))}>{surgery.reference}</a>
      </th>
      <td>{surgery.vertebrae.join(" ")}</td>
      <td>{surgery.reference_vertebra}</td>
      <td class="number">{names.size}</td>
      <td>
        {newest === undefined ? (
          <span class="muted">none yet</span>
        ) : (
          <span class="row">
            {newest.name} <StateMark state={newest.state} />
          </span>
        )}
      </td>
      <td class="muted">{dayAndTime(surgery.created_at)}</td>
    </tr>
  );
}
