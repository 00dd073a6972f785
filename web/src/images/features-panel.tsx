/** Features that are no ball of a triad, and why. */
import type { VNode } from "preact";
import { useState } from "preact/hooks";

import { Quantity } from "../format/quantity";
import { type Side, SIDES } from "./camera";
import { FEATURE_REASONS } from "./reasons";
import { type Centre, centreName, deviations, type FeatureReason, type Scene } from "./scene";

const PAGE = 40;
const REASONS = Object.keys(FEATURE_REASONS) as FeatureReason[];

interface FeaturesPanelProps {
  scene: Scene;
  onSelect: (side: Side, key: string) => void;
  onHover: (place: { side: Side; key: string } | null) => void;
}

/** The features of one image as a list that can be filtered. */
export function FeaturesPanel({ scene, onSelect, onHover }: FeaturesPanelProps): VNode {
  const [side, setSide] = useState<Side>("left");
  const [reason, setReason] = useState<FeatureReason | "all">("all");
  const [count, setCount] = useState(PAGE);
  const others = scene[side].filter((centre) => centre.triad === null && centre.feature !== null);
  const listed = others.filter((centre) => reason === "all" || centre.reason === reason);
  return (
    <div class="stack">
      <div class="row">
        <label class="field">
          <span class="label">Image</span>
          <select aria-label="Image" value={side} onChange={(event) => setSide(event.currentTarget.value as Side)}>
            {SIDES.map((value) => (
              <option value={value}>{value}</option>
            ))}
          </select>
        </label>
        <label class="field triplet-filter">
          <span class="label">Show</span>
          <select aria-label="Which features" value={reason} onChange={(event) => setReason(event.currentTarget.value as FeatureReason | "all")}>
            <option value="all">All that are no ball ({others.length})</option>
            {REASONS.map((value) => (
              <option value={value}>
                {FEATURE_REASONS[value]} ({others.filter((centre) => centre.reason === value).length})
              </option>
            ))}
          </select>
        </label>
      </div>
      <div class="scroll-x">
        <table>
          <caption>{listed.length} features of the {side} image, best score first; u, v in px ± one standard deviation.</caption>
          <thead>
            <tr>
              <th scope="col">Feature</th>
              <th scope="col" class="number">u</th>
              <th scope="col" class="number">v</th>
              <th scope="col" class="number">Score (0 to 1)</th>
              <th scope="col">No ball because</th>
            </tr>
          </thead>
          <tbody>
            {listed.slice(0, count).map((centre) => (
              <Row scene={scene} centre={centre} onSelect={onSelect} onHover={onHover} />
            ))}
          </tbody>
        </table>
      </div>
      {listed.length > count && (
        <button type="button" class="button" onClick={() => setCount(count + PAGE)}>
          Show {Math.min(PAGE, listed.length - count)} more
        </button>
      )}
    </div>
  );
}

function Row({ scene, centre, onSelect, onHover }: FeaturesPanelProps & { centre: Centre }): VNode {
  const sd = deviations(centre);
  const place = { side: centre.side, key: centre.key };
  return (
    <tr onPointerEnter={() => onHover(place)} onPointerLeave={() => onHover(null)}>
      <th scope="row">
        <button
          type="button"
          class="link-button"
          onClick={() => onSelect(centre.side, centre.key)}
          onFocus={() => onHover(place)}
          onBlur={() => onHover(null)}
        >
          {centreName(scene, centre)}
        </button>
      </th>
      <td class="number">
        <Quantity value={centre.pixel[0]} sd={sd?.[0]} unit="px" digits={2} />
      </td>
      <td class="number">
        <Quantity value={centre.pixel[1]} sd={sd?.[1]} unit="px" digits={2} />
      </td>
      <td class="number">{centre.score === null ? "–" : centre.score.toFixed(2)}</td>
      <td>{centre.reason === null ? <span class="muted">not recorded</span> : FEATURE_REASONS[centre.reason]}</td>
    </tr>
  );
}
